"""The game's paper at true scale: sheet, calibration board and cards as PDF pages."""
