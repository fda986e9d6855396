"""What the camera sees: the card, the sheet and the tubes."""
