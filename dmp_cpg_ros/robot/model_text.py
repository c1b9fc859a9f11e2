# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the text of a model asks for, before MuJoCo reads it.

A few lines of MJCF can name files without an end and ask for more bodies and bytes than there is
time and memory; MuJoCo makes what ``replicate`` and ``flexcomp`` ask for while it reads.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.parsers import expat

from dmp_cpg_ros.core.errors import ParameterError
from dmp_cpg_ros.core.parameters import shown
from dmp_cpg_ros.files import other_than_file, readable
from dmp_cpg_ros.strict_yaml import DEEPEST

BODIES, COPIES, ELEMENTS = 'bodies', 'elements by multiplication', 'elements'
BYTES, TEXT = 'bytes of memory', 'bytes of XML'

MOST = {BODIES: 1000, COPIES: 5000, ELEMENTS: 50_000, BYTES: 400_000_000, TEXT: 2**23}
"""What a model may ask for, all in all. MuJoCo's time grows with the square of bodies and copies:
so many take it seconds."""


_KEY = 40_000
"""As much time is taken for a keyframe as for so many bytes."""

_SMALLEST_VERTEX = 12
"""Three floats of a file [B]."""

_PNG = b'\x89PNG\r\n\x1a\n'
_CHANNEL, _CELL, _NUMBER, _VERTEX = 2, 16, 24, 2000
"""Memory that MuJoCo 4.0 takes for one of a texture, a height field, an array, a mesh [B]."""


def check_text(path: Path) -> None:
    """Refuse a model that MuJoCo would read or compile for ever, or with all memory.

    Parameters
    ----------
    path : Path
        MJCF or URDF; what it includes, attaches and names is looked at too.

    Raises
    ------
    ParameterError
        If it is not well-formed XML, asks for more than ``MOST``, or names a pipe or a device;
        the text names the element and the limit.
    """
    _Model(path, path, {}).read()


class _Model:
    """One model, with what it includes.

    Parameters
    ----------
    told : Path
        The model that is loaded, for errors.
    path : Path
        This one: the same, or one that it attaches.
    known : dict of Path to dict or None
        What the models that were read ask for; None while they are.
    """

    def __init__(self, told: Path, path: Path, known: dict[Path, dict[str, float] | None]) -> None:
        """Nothing is read."""
        self._told, self._path, self._known = told, path, known
        self._asked = dict.fromkeys(MOST, 0.0)
        self._folders = {path.parent: None}
        self._named: list[str] = []
        self._models: list[tuple[str, Path]] = []
        self._flexed: list[tuple[str, float]] = []
        self._attached = self._samples = 0.0

    def read(self) -> dict[str, float]:
        """Read it; returns what it asks for."""
        if sum(of is None for of in self._known.values()) > DEEPEST:
            raise ParameterError(f"model '{self._told}' attaches models deeper than {DEEPEST}")
        self._known[self._path.resolve()] = None
        self._read(self._path, 1.0, '', 0)
        pixels = [self._pixels(place) for place in dict.fromkeys(
            place for name in self._named for place in self._places(name))]
        # the largest is unpacked beside the others
        self._ask('texture', BYTES, 3 * _CHANNEL * sum(pixels) + 4 * max(pixels, default=0))
        for name, times in self._flexed:
            sizes = [place.stat().st_size for place in self._places(name) if place.is_file()]
            self._ask('flexcomp', BODIES, times * max(sizes, default=0) / _SMALLEST_VERTEX)
        self._ask('nsample', BYTES, _NUMBER * self._samples * self._asked[ELEMENTS])
        asked = [self._of_model(*of) for of in self._models]
        for what in (BODIES, COPIES, ELEMENTS, BYTES, TEXT):
            self._ask('model', what, sum(of[what] for of in asked))
            most = max((of[what] for of in asked), default=0)
            if what != TEXT:
                self._ask('attach', COPIES if what == ELEMENTS else what, self._attached * most)
        self._known[self._path.resolve()] = self._asked
        return self._asked

    def _of_model(self, name: str, folder: Path) -> dict[str, float]:
        """What the model asks for that an element names."""
        most = dict.fromkeys(MOST, 0.0)
        for place in self._places(name, folder):
            if place.is_file():
                if place.resolve() not in self._known:
                    _Model(self._told, place, self._known).read()
                asked = self._known[place.resolve()]
                if asked is None:
                    raise ParameterError(f"model '{self._told}' attaches '{place}' to itself")
                most = {what: max(most[what], asked[what]) for what in MOST}
        return most

    def _read(self, file: Path, times: float, within: str, depth: int) -> None:
        """Read one file, which stands so many times in the model; in which element, and how deep
        in files that include it.
        """
        if depth > DEEPEST:
            raise ParameterError(f"model '{self._told}' includes files deeper than {DEEPEST}")
        with readable(file).open('rb') as stream:
            text = stream.read(MOST[TEXT] + 1)
        self._ask('include' if depth else 'file', TEXT, len(text))
        stack, includes = [(times, within)], list[tuple[str, float, str]]()
        parser = expat.ParserCreate('utf-8')

        def begin(tag: str, given: dict[str, str]) -> None:
            times, within = stack[-1]
            own = self._times(tag, given)
            stack.append((times * own, tag if own > 1.0 else within))
            self._count(tag, given, times, within)
            self._folders.update({self._path.parent / value: None for name, value in given.items()
                                  if name in ('meshdir', 'texturedir', 'assetdir')})
            names = [value for name, value in given.items()
                     if name.startswith('file') and value and '\0' not in value]
            self._named += names
            if tag == 'include':
                includes.extend((name, times, within) for name in names)
            elif tag == 'model':
                self._models += [(name, file.parent) for name in names]

        def declare(*_: object) -> None:  # MuJoCo would find elements in it that are none
            raise ParameterError(f"model '{self._told}': a <!DOCTYPE> is not valid in '{file}'")

        parser.StartElementHandler, parser.StartDoctypeDeclHandler = begin, declare
        parser.EndElementHandler = lambda tag: stack.pop() and None
        try:
            parser.Parse(text, True)
        except expat.ExpatError as error:
            raise ParameterError(
                f"model '{self._told}': '{file}' is not well-formed XML: {error}") from None
        for name, times, within in includes:
            for place in self._places(name, file.parent):
                self._check_named(place)
                if place.is_file():
                    self._read(place, times, within, depth + 1)

    def _places(self, name: str, *beside: Path) -> Iterator[Path]:
        """Where a file of a name may be."""
        for place in dict.fromkeys((*self._folders, *beside)):
            yield from dict.fromkeys((place / name, place / Path(name).name))

    def _pixels(self, place: Path) -> int:
        """Number of pixels that a PNG file unpacks into; none of other files."""
        self._check_named(place)
        head = b''
        if place.is_file():
            with place.open('rb') as stream:
                head = stream.read(24)
        if len(head) < 24 or not head.startswith(_PNG):
            return 0
        width, height = struct.unpack('>II', head[16:])
        return int(width * height)

    def _check_named(self, place: Path) -> None:
        if (kind := other_than_file(place)) and not place.is_dir():
            raise ParameterError(f"model '{self._told}' names '{place}', which {kind}, not a file")

    def _times(self, tag: str, given: Mapping[str, str]) -> float:
        """How often what is in an element stands in the model."""
        if tag == 'replicate':
            return max(self._product(tag, given, 'count'), 1.0)
        return 1.0

    def _count(self, tag: str, given: Mapping[str, str], times: float, within: str) -> None:
        """Count an element, which stands so many times in the model."""
        made = times
        if tag in ('flexcomp', 'composite'):
            made *= max(len(given['point'].split()) / 3 if 'point' in given else
                        self._product(tag, given, 'count', '1' if 'file' in given else '10 10 10'),
                        1.0)
            self._flexed += [(given['file'], times)] if given.get('file') else []
        elif tag == 'attach':
            self._attached += times
        what = within or tag if made == times else tag
        if tag in ('body', 'flexcomp', 'composite', 'link'):
            self._ask(what, BODIES, made)
        self._ask(what, ELEMENTS, 1.0)
        if made > 1.0:
            self._ask(what, COPIES, made)
        self._ask(tag, BYTES, times * self._bytes(tag, given))

    def _bytes(self, tag: str, given: Mapping[str, str]) -> float:
        """Memory that an element asks for by a number [B]."""
        asked = 0.0
        self._samples = max(self._samples, self._product(tag, given, 'nsample', '0'))
        if tag == 'texture' and given.get('builtin', 'none') != 'none':
            width, height = (self._product(tag, given, side, '0') for side in ('width', 'height'))
            if given.get('type', 'cube') != '2d':
                height = 6.0 * width
            asked = _CHANNEL * width * height * self._product(tag, given, 'nchannel', '3')
        elif tag == 'hfield':
            asked = _CELL * self._product(tag, given, 'nrow', '0') * self._product(
                tag, given, 'ncol', '0')
        elif tag == 'camera':
            asked = _CELL * self._product(tag, given, 'resolution')
        elif tag == 'numeric':
            asked = _NUMBER * self._product(tag, given, 'size', '0')
        elif tag == 'mesh' and 'builtin' in given:
            asked = _VERTEX * max(self._numbers(tag, given, 'params', '0'), default=0.0)**2
        elif tag == 'size':
            asked = _KEY * self._product(tag, given, 'nkey', '0') + sum(
                _NUMBER * self._product(tag, given, name, '0') * (
                    1 if name == 'nuserdata' else MOST[BODIES])
                for name in given if name.startswith('nuser'))
        return asked

    def _product(self, tag: str, given: Mapping[str, str], name: str, usual: str = '1') -> float:
        return math.prod(self._numbers(tag, given, name, usual))

    def _numbers(self, tag: str, given: Mapping[str, str], name: str, usual: str) -> list[float]:
        """Sizes of the numbers of an attribute."""
        text = given.get(name, usual)
        try:
            sizes = [abs(float(word)) for word in text.split()]
            return [size if math.isfinite(size) else math.inf for size in sizes]
        except ValueError:
            raise ParameterError(f"model '{self._told}': {name} of <{tag}> must be numbers, not "
                                 f'{shown(text)}') from None

    def _ask(self, tag: str, what: str, number: float) -> None:
        """Add to what is asked for; refuse too much, and what is no number."""
        self._asked[what] += number
        if not self._asked[what] <= MOST[what]:
            raise ParameterError(
                f"model '{self._told}' asks for {self._asked[what]:g} {what} with <{tag}>; valid "
                f'are at most {MOST[what]}')
