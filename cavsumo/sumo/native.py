"""Functions of SUMO's library that libsumo does not offer, called by their C++ names.

They are those with which SUMO itself starts: it sets its options, seeds its generators, opens its
route files, and sets up its XML parser (Xerces). A build of libsumo that has other functions cannot
be called so.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

from cavsumo.errors import SimulationError

OPTIONS = "_ZN11OptionsCont10getOptionsEv"
WRITABLE = "_ZN11OptionsCont13resetWritableEv"
SET = "_ZN11OptionsCont3setERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEES7_b"
SEED_ALL = "_ZN9NLBuilder14initRandomnessEv"
OPEN_ROUTES = "_ZN9NLBuilder23buildRouteLoaderControlERK11OptionsCont"
READ_ROUTES = "_ZN22SUMORouteLoaderControl8loadNextEx"
SET_UP_XML = (
    "_ZN11xercesc_3_216XMLPlatformUtils10InitializeEPKcS2_PNS_12PanicHandlerEPNS_13MemoryManagerE"
)
LANGUAGE = b"en_US"  # of the parser's messages, as SUMO has it


@cache
def keep_xml(sumo: Any) -> None:
    """Have the XML parser set up for as long as this process lives.

    Each start of SUMO sets it up and each end takes it down, which takes more than a millisecond.
    The parser counts who uses it. A build with another parser goes on as ever.

    Args:
        sumo: the module libsumo.
    """
    set_up = getattr(ctypes.CDLL(sumo._libsumo.__file__), SET_UP_XML, None)
    if set_up is not None:
        set_up(ctypes.c_char_p(LANGUAGE), None, None, None)


class StdString(ctypes.Structure):
    """A std::string of libstdc++ that is only read: a pointer to its characters, and their number.

    A short string holds its characters itself, in the room that a long one has for its capacity.
    """

    _fields_ = (("data", ctypes.c_void_p), ("size", ctypes.c_size_t), ("own", ctypes.c_char * 16))


class Library:
    """The library of libsumo.

    Args:
        sumo: the module libsumo, with a simulation when a function is called.

    Attributes:
        complete: whether it has all functions that are called here.
    """

    def __init__(self, sumo: Any) -> None:
        self._sumo = sumo
        self._library = ctypes.CDLL(sumo._libsumo.__file__)
        names = OPTIONS, WRITABLE, SET, SEED_ALL, OPEN_ROUTES, READ_ROUTES
        self.complete = all(hasattr(self._library, name) for name in names)

    def set_option(self, name: str, value: str) -> None:
        """Set an option of the running simulation; SimulationError if it is not set then."""
        put, all_options = self._library[SET], self._options()
        put.restype = ctypes.c_bool
        self._library[WRITABLE](all_options)
        kept = [ctypes.create_string_buffer(word.encode()) for word in (name, value)]
        words = [StdString(ctypes.addressof(w), len(w) - 1) for w in kept]
        put(all_options, *map(ctypes.byref, words), ctypes.c_bool(False))
        if self._sumo.simulation.getOption(name) != value:
            raise SimulationError(f"this build of libsumo cannot set the option {name!r}")

    def seed_all(self) -> None:
        """Seed all generators as a start with the present option ``seed`` does."""
        self._library[SEED_ALL]()

    def open_routes(self) -> ctypes.c_void_p:
        """SUMO's reader of the files in its present option ``route-files``.

        SUMO ends the process when one cannot be read.
        """
        build = self._library[OPEN_ROUTES]
        build.restype = ctypes.c_void_p
        return ctypes.c_void_p(build(self._options()))

    def read_routes(self, reader: ctypes.c_void_p, time: float) -> None:
        """Have such a reader read what departs from a time on [s], as far ahead as SUMO does.

        SUMO ends the process when there is an error in the file.
        """
        self._library[READ_ROUTES](reader, ctypes.c_longlong(round(1000.0 * time)))

    def _options(self) -> ctypes.c_void_p:
        """The options of the simulation."""
        options = self._library[OPTIONS]
        options.restype = ctypes.c_void_p
        return ctypes.c_void_p(options())
