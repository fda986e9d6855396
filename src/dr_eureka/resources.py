"""Files that ship with the package: where they are, and loading them safely.

The same calls work from a checkout, a catkin devel space (whose modules are the checkout's) and an install space.
"""

from __future__ import annotations

import hashlib
import zipfile
from pathlib import Path
from typing import Any, Mapping

import numpy as np
import yaml

from dr_eureka.errors import DrEurekaError

PACKAGE = "dr_eureka"
WEIGHTS_FOLDER = "config/weights"
SUMS_FILE = "SHA256SUMS"


class ResourceError(DrEurekaError):
    """A file of the package is missing or cannot be read as what it should be."""


class WeightsError(ResourceError):
    """A weights file is missing, unlisted, altered, or not a plain `.npz`."""


def package_root() -> Path:
    """Return the folder that holds `package.xml`, `config/` and `launch/`.

    Raises ResourceError when this module lies in neither a source tree nor an install space.
    """
    here = Path(__file__).resolve()
    for folder in here.parents:
        if (folder / "package.xml").is_file() and (folder / "src" / PACKAGE).is_dir():
            return folder
        installed = folder / "share" / PACKAGE
        if (installed / "package.xml").is_file():
            return installed
    raise ResourceError(f"{here}: no package.xml of {PACKAGE} in any folder above; expected a source tree or install space")


def resource_path(relative: str | Path) -> Path:
    """Return the absolute path of a file or folder named relative to the package, such as `config/pieces.yaml`.

    The file need not exist: scripts that make one ask here where it goes. An absolute path is returned as it is.
    """
    return package_root() / relative


class _StrictLoader(yaml.SafeLoader):
    """PyYAML's safe loader, but a key given twice is an error: plain PyYAML silently keeps the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict:
        seen = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                continue
            key = self.construct_object(key_node)
            if key in seen:
                raise yaml.constructor.ConstructorError(problem=f"key {key!r} is given twice", problem_mark=key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


def load_yaml(path: str | Path) -> dict[Any, Any]:
    """Load a yaml file whose top level is a mapping; a relative path is relative to the package.

    Raises ResourceError naming the file, and the line where the yaml is broken.
    """
    file = resource_path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ResourceError(f"{file}: cannot be read: {_reason(error)}; expected a yaml file") from error
    try:
        # A SafeLoader subclass: only plain values are ever made.
        content = yaml.load(text, Loader=_StrictLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        raise ResourceError(f"{file}{line}: not valid yaml: {getattr(error, 'problem', None) or error}") from error
    if not isinstance(content, dict):
        raise ResourceError(f"{file}: holds {type(content).__name__}; expected a mapping of keys to values")
    return content


def load_weights(name: str, folder: Path | None = None) -> dict[str, np.ndarray]:
    """Load the arrays of a shipped `.npz`, after checking it against the SHA-256 in `SHA256SUMS` beside it.

    `folder` defaults to the package's `config/weights`. Nothing in the file is ever executed: object arrays are
    refused. Raises WeightsError naming the file and what was expected.
    """
    folder = folder or resource_path(WEIGHTS_FOLDER)
    file = folder / name
    expected = _read_sums(folder / SUMS_FILE)
    if name not in expected:
        known = ", ".join(sorted(expected)) or "nothing"
        raise WeightsError(f"{file}: not listed in {SUMS_FILE}; it lists {known}")
    try:
        found = hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError as error:
        raise WeightsError(f"{file}: cannot be read: {_reason(error)}; expected the weights with SHA-256 {expected[name]}") from error
    if found != expected[name]:
        raise WeightsError(f"{file}: SHA-256 is {found}; {SUMS_FILE} expects {expected[name]}")
    try:
        with np.load(file, allow_pickle=False) as archive:
            return {key: archive[key] for key in archive.files}
    except (ValueError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise WeightsError(f"{file}: not a plain .npz of number arrays: {error}") from error


def save_weights(name: str, arrays: Mapping[str, np.ndarray], folder: Path | None = None) -> Path:
    """Write arrays as `.npz` and record the file's SHA-256, so that `load_weights` accepts it.

    Equal arrays give an equal file: numpy writes no time stamps. Returns the path of the file.
    """
    folder = folder or resource_path(WEIGHTS_FOLDER)
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / name
    np.savez(file, **arrays)
    sums_file = folder / SUMS_FILE
    sums = _read_sums(sums_file) if sums_file.exists() else {}
    sums[name] = hashlib.sha256(file.read_bytes()).hexdigest()
    sums_file.write_text("".join(f"{digest}  {key}\n" for key, digest in sorted(sums.items())), encoding="ascii")
    return file


def _read_sums(file: Path) -> dict[str, str]:
    """Return file name -> SHA-256 from a file in the format of `sha256sum`."""
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise WeightsError(f"{file}: cannot be read: {_reason(error)}; expected the SHA-256 of every weights file") from error
    sums = {}
    for number, line in enumerate(lines, start=1):
        digest, _, name = line.partition("  ")
        if len(digest) != 64 or not name:
            raise WeightsError(f"{file}:{number}: is {line!r}; expected '<SHA-256>  <file name>'")
        sums[name] = digest
    return sums


def _reason(error: Exception) -> str:
    """Return the operating system's words for an error, without number and path."""
    return getattr(error, "strerror", None) or str(error)
