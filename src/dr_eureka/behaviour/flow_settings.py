"""Settings of the game flow: where to look, how long to wait."""

from __future__ import annotations

from dataclasses import dataclass, field

from dr_eureka.behaviour.observation import Gaze

_SECONDS = {"min": 0.1, "max": 3600.0}


@dataclass(frozen=True)
class FlowSettings:
    """Limits are wall time [s], so that they also end when robot time stands still; motions are robot time [s]."""

    engine_limit: float = field(metadata=_SECONDS)
    engine_silence: float = field(metadata=_SECONDS)
    camera_limit: float = field(metadata=_SECONDS)
    frozen_limit: float = field(metadata=_SECONDS)
    head_limit: float = field(metadata=_SECONDS)
    card_limit: float = field(metadata=_SECONDS)
    confirm_limit: float = field(metadata=_SECONDS)
    tubes_limit: float = field(metadata=_SECONDS)
    check_limit: float = field(metadata=_SECONDS)
    held_limit: float = field(metadata=_SECONDS)
    held_images: int = field(metadata={"min": 1, "max": 20})
    pours_per_look: int = field(metadata={"min": 1, "max": 100})
    most_replans: int = field(metadata={"min": 0, "max": 20})
    head_duration: float = field(metadata=_SECONDS)
    head_tolerance: float = field(metadata={"min": 0.0, "max": 0.5})
    card_gaze: Gaze
    sheet_gaze: Gaze
    second_sheet_gaze: Gaze
    watch_gaze: Gaze
