"""Settings in yaml told of what was measured; their comments and all other figures stay as they are."""
from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any, Optional, Union

from ruamel.yaml import YAML

from dr_eureka.errors import DrEurekaError
from dr_eureka.game.planner_settings import PLANNER_FILE, planner_settings
from dr_eureka.resources import resource_path

#: Place of a figure in a yaml such as config/planner.yaml: ("durations", "pick", "from_home", "left", "center").
Key = tuple[Union[str, int], ...]
#: What stands there, such as {"seconds": 4.89, "trials": 13}.
Figure = Mapping[str, Union[float, int]]


class PlannerFileError(DrEurekaError):
    """The planner's settings cannot be written."""


def figure_at(content: Any, key: Key) -> Optional[Figure]:
    """Return the figure at a place of the yaml's content, None where the planner has no use for one."""
    for name in key:
        content = content.get(name) if isinstance(content, Mapping) else None
    return content


def rewrite(text: str, figures: Mapping[Key, Figure]) -> str:
    """Return the text of a yaml with figures that it has replaced by others."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    content = yaml.load(text)
    for key, figure in figures.items():
        node = figure_at(content, key)
        as_written = {name: name for name in node}  # a name keeps its quotes
        for name in as_written:
            del node[name]
        node.update({as_written.get(name, name): value for name, value in figure.items()})
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def write(figures: Mapping[Key, Figure]) -> None:
    """Rewrite config/planner.yaml.

    Raises SettingsError, and leaves the file as it is, for figures that no plan can be made with; PlannerFileError where it
    cannot be written.
    """
    file = resource_path(PLANNER_FILE)
    text = rewrite(file.read_text(encoding="utf-8"), figures)
    planner_settings(YAML(typ="safe").load(text), PLANNER_FILE)
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise PlannerFileError(f"{file}: {error.strerror}; expected a file that can be written") from error
