# Copyright 2026 The dmp_cpg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Gaits by the words that travel with the phases (:mod:`~dmp_cpg_ros.core.gait.gait_word`)."""

from __future__ import annotations

from collections.abc import Mapping

from dmp_cpg_ros.core.errors import DataError, ParameterError
from dmp_cpg_ros.core.gait.gait import Gait
from dmp_cpg_ros.core.gait.gait_word import read_gait_word
from dmp_cpg_ros.core.gait.transition import BlendedGait, GaitInForce, GaitTransition


class GaitReader:
    """Reads words; the last one and the transitions that were seen are kept.

    Parameters
    ----------
    gaits : mapping of str to Gait
        Gaits by name.
    unnamed : Gait, optional
        What an empty text means: recordings from before gaits could change have none.
    """

    def __init__(self, gaits: Mapping[str, Gait], unnamed: Gait | None = None) -> None:
        """Remember the gaits."""
        self.gaits, self.unnamed = dict(gaits), unnamed
        self._transitions: dict[tuple[str, str], GaitTransition] = {}
        self._last: tuple[str, GaitInForce] | None = None

    def read(self, word: str) -> GaitInForce:
        """Gait of a word; the same object while the word stays.

        Raises
        ------
        DataError
            If the text is no such word, or names a gait that is not known; the valid names are
            listed.
        """
        if self._last is not None and word == self._last[0]:
            return self._last[1]
        gait = self._parsed(word)
        self._last = (word, gait)
        return gait

    def at_cadence(self, gait: GaitInForce, cadence_scale: float) -> GaitInForce:
        """Return a gait with this factor on its cadence instead of the one that it has."""
        if isinstance(gait, BlendedGait):
            return gait.scaled(cadence_scale)
        return self.named(gait.name).scaled(cadence_scale)

    def transition(self, before: Gait, after: Gait) -> GaitTransition:
        """Way from one gait to another; its arcs are chosen once."""
        names = (before.name, after.name)
        found = self._transitions.get(names)
        if found is None or found.before is not before or found.after is not after:
            found = self._transitions[names] = GaitTransition(before, after)
        return found

    def named(self, name: str) -> Gait:
        """Gait of a name; raises ParameterError with the valid names."""
        if name not in self.gaits:
            raise ParameterError(
                f"there is no gait '{name}'; valid are {', '.join(self.gaits)}")
        return self.gaits[name]

    def _parsed(self, word: str) -> GaitInForce:
        if not word and self.unnamed is not None:
            return self.unnamed
        text, cadence_scale = read_gait_word(word)
        try:
            if '>' not in text:
                return self.named(text).scaled(cadence_scale)
            names, share, rate = text.split(' ')
            before, after = names.split('>')
            transition = self.transition(self.named(before), self.named(after))
            return transition.at(float(share), float(rate)).scaled(cadence_scale)
        except ParameterError as error:
            raise DataError(f"gait '{word}': {error}") from error
        except ValueError as error:
            raise DataError(
                f"gait '{word}' must be the name of a gait or like 'amble>trot 0.35 0.61'"
            ) from error
