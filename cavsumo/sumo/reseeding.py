"""New random numbers in a running simulation of SUMO.

SUMO draws from generators that it seeds once, when it starts, from its option ``seed``; neither
libsumo nor traci can seed them again. The library itself can, by the functions with which it starts
(``OptionsCont``, ``NLBuilder::initRandomness``). They are called here by their C++ names.
"""

from __future__ import annotations

import ctypes
from typing import Any

from cavsumo.errors import SimulationError

OPTIONS = "_ZN11OptionsCont10getOptionsEv"
WRITABLE = "_ZN11OptionsCont13resetWritableEv"
SET = "_ZN11OptionsCont3setERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEES7_b"
SEED_ALL = "_ZN9NLBuilder14initRandomnessEv"
REFUSED = "this build of libsumo cannot seed a running simulation; branch without a seed"


class StdString(ctypes.Structure):
    """A short std::string of libstdc++: a pointer to its characters, which it holds itself."""

    _fields_ = (("data", ctypes.c_void_p), ("size", ctypes.c_size_t), ("own", ctypes.c_char * 16))


def reseed(sumo: Any, seed: int) -> None:
    """Seed all generators of SUMO as a start with that seed does.

    Args:
        sumo: the module libsumo, with a simulation.

    Raises SimulationError if this build of libsumo has other functions.
    """
    library = ctypes.CDLL(sumo._libsumo.__file__)
    try:
        options, writable, put, seed_all = (
            library[name] for name in (OPTIONS, WRITABLE, SET, SEED_ALL)
        )
    except AttributeError as error:
        raise SimulationError(REFUSED) from error
    options.restype, put.restype = ctypes.c_void_p, ctypes.c_bool
    all_options = ctypes.c_void_p(options())
    writable(all_options)
    name, value = _text("seed"), _text(str(seed % 2**31))
    put(all_options, ctypes.byref(name), ctypes.byref(value), ctypes.c_bool(False))
    if sumo.simulation.getOption("seed") != str(seed % 2**31):
        raise SimulationError(REFUSED)
    seed_all()


def _text(words: str) -> StdString:
    """A std::string of at most 15 characters."""
    text = StdString(size=len(words), own=words.encode("ascii"))
    text.data = ctypes.addressof(text) + StdString.own.offset
    return text
