# SPDX-License-Identifier: MIT
"""What some answers become, and what can go wrong."""
from __future__ import annotations

import dataclasses
import functools
from typing import Any, Callable, Dict, List, Optional


class Error(Exception):
    """Of everything that goes wrong here."""


class NoDaemon(Error):
    """Nobody listens at the path."""


class NoPermission(Error):
    """The socket is there, this user may not use it."""


class Silent(Error, TimeoutError):
    """No answer within the timeout. The connection may be used again."""


class Lost(Error, ConnectionError):
    """The connection ended, or what came was no answer: make a new one."""


class Refused(Error):
    """The daemon answered with an error; code is that of JSON-RPC."""

    def __init__(self, method: str, code: int, message: str):
        super().__init__("%s: %s" % (method, message))
        self.code = code


@dataclasses.dataclass(frozen=True)
class Blocked:
    state: str  # "blocked", "clear" or "unknown"
    range_m: Optional[float]  # of the nearest obstacle; None unless blocked
    range_sd_m: Optional[float]
    confidence: float
    free_to_m: float  # the water is known to be free up to here
    blind_to_m: float  # nothing is known nearer than this
    age_s: Optional[float]  # of the oldest evidence that counts; None: there is none
    reason: str
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


@dataclasses.dataclass(frozen=True)
class Sector:
    azimuth_deg: float  # of its middle
    width_deg: float
    state: str
    range_m: Optional[float]  # of the nearest obstacle, at any distance; None: none
    free_to_m: float
    blind_to_m: float  # nothing is known nearer than this: free and clear are so from here on
    age_s: Optional[float]


@dataclasses.dataclass(frozen=True)
class Limit:
    velocity_mps: List[float]  # that may be flown, in the axes of the one asked for
    speed_mps: float
    asked_mps: float
    limited_by: str  # "nothing", "blocked" or "unknown"
    azimuth_deg: Optional[float]  # of what limits; None: nothing does, or in no direction of its own
    elevation_deg: Optional[float]
    stop_m: float
    uncertain_m: float  # beside it: the vehicle may be so far from where it is taken to be
    blocked_m: Optional[float]
    free_m: float
    age_s: Optional[float]
    reason: str
    remedy: str  # what would lift it
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


@dataclasses.dataclass(frozen=True)
class Collision:
    state: str
    time_s: Optional[float]  # None unless blocked
    time_sd_s: Optional[float]
    distance_m: Optional[float]
    confidence: Optional[float]
    unknown_after_s: Optional[float]  # the corridor is unknown from then on; None: it is not
    speed_mps: float
    ahead_s: float
    age_s: Optional[float]
    reason: str
    target: str  # the weakest obstacle that free water is without; a weaker one may be there
    bottom_db: Optional[float]  # the softest bottom likewise, in dB below a wall; None: soft bottoms may be there


def _typed(kind: Any, result: Any) -> Any:
    """The fields that this file knows; a daemon that is newer may say more, one that says less gave no answer."""
    try:
        return kind(**{field.name: result[field.name] for field in dataclasses.fields(kind)})
    except (KeyError, TypeError) as fault:
        raise Lost("the answer is not one that this module knows: %s" % fault) from None


def _sectors(result: Any) -> List[Sector]:
    if not isinstance(result, dict) or not isinstance(result.get("sectors"), list):
        raise Lost("the answer is not one that this module knows: no sectors")
    return [_typed(Sector, sector) for sector in result["sectors"]]


# What the result of these methods becomes.
TYPES: Dict[str, Callable[[Any], Any]] = {
    "blocked": functools.partial(_typed, Blocked),
    "sectors": _sectors,
    "limit": functools.partial(_typed, Limit),
    "time_to_collision": functools.partial(_typed, Collision),
}


def refused(method: str, error: Any) -> Refused:
    """What a reply says of a request that was refused."""
    if not isinstance(error, dict):
        raise Lost("%s: a reply whose error is none" % method)
    return Refused(method, error.get("code", 0), error.get("message", "an error without a message"))


def instead_of(before: Dict[str, Any], said: Dict[str, Any]) -> Dict[str, Any]:
    """What a watch said last. Nobody has read what it said before: an old answer is not given for a new one."""
    return dict(said, skipped=said.get("skipped", 0) + before.get("skipped", 0) + 1)


def given(params: Dict[str, Any]) -> Dict[str, Any]:
    """Without what is None: that is left to the daemon."""
    return {name: list(value) if isinstance(value, tuple) else value for name, value in params.items() if value is not None}
