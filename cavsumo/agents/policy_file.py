"""A trained policy as a file: a small network that turns an observation into an action.

An ``.npz`` archive of plain arrays (nothing in it is ever executed):

==================== ======================== =================================================
array                shape                    meaning
==================== ======================== =================================================
``header``           ()                       JSON text, see below
``mean``, ``scale``  (n,)                     an observation enters as (x - mean) / scale,
                                              clipped to [-clip, clip]
``weights0``         (n, h)                   first layer: x W + b, then the activation
``biases0``          (h,)
...                                           further layers, activated but for the last
``table``            (choices, 2 * bodies)    for actions "table" only
==================== ======================== =================================================

The header has the keys ``format`` ("cavsumo-policy"), ``version`` (1), ``observation`` (version and
names of the entries, see ``observations``), ``bodies`` (how many one copy of the policy owns),
``kind`` (of body), ``hold`` (timesteps that an action lasts), ``activation`` ("relu" or "tanh"),
``clip``, ``actions`` and ``metadata`` (anything). ``actions`` says what comes out:

* "effectors": for each body throttle and steering in [-1, 1], what lies outside is clipped: from
  the lower to the upper limit of the effector;
* "table": a score for each row of ``table``; the first row with the best score is taken; a row
  holds throttle and steering for each body as above;
* "targets": for each body a score for each of ``agents.features.TARGETS``: to stand, or to walk at
  full speed along a heading relative to the way across the road. The body steers to it at full
  steering in every timestep. For pedestrians only.

Everything is computed in float64 by sums in a fixed order, so that with "relu" a policy says the
same, bit for bit, on every machine.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cavsumo.agents.features import TARGETS
from cavsumo.agents.observations import VERSION as OBSERVATION_VERSION
from cavsumo.agents.observations import entries
from cavsumo.errors import InputError
from cavsumo.model.bodies import KINDS, WALKING
from cavsumo.model.documents import first_problem, json_of

LARGEST_B = 64 * 2**20  # far more than a policy needs; a larger archive is refused
Array = NDArray[np.float64]


class Observed(BaseModel):
    """The observation on which a policy was trained."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: int
    names: tuple[str, ...]


class Header(BaseModel):
    """The header of a policy file; the module's docstring explains the keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["cavsumo-policy"] = "cavsumo-policy"
    version: Literal[1] = 1
    observation: Observed
    bodies: int = Field(1, ge=1, le=100)
    kind: str = WALKING[0]
    hold: int = Field(1, ge=1, le=100_000)
    activation: Literal["relu", "tanh"] = "relu"
    clip: float = Field(10.0, gt=0.0)
    actions: Literal["effectors", "table", "targets"] = "effectors"
    metadata: dict[str, Any] = {}


@dataclass(frozen=True, eq=False)
class TrainedPolicy:
    """A policy; ValueError for parts that do not fit together.

    Attributes:
        header: the header of the file.
        mean, scale: of the observation, shape (n,).
        layers: weights and biases of each layer.
        table: the actions to choose from, shape (choices, 2 * bodies), or None.
    """

    header: Header
    mean: Array
    scale: Array
    layers: tuple[tuple[Array, Array], ...]
    table: Array | None = None

    def __post_init__(self) -> None:
        _check_header(self.header)
        sizes = [len(self.header.observation.names)]
        _check("mean", self.mean, (sizes[0],))
        _check("scale", self.scale, (sizes[0],))
        if not (self.scale > 0.0).all():
            raise ValueError("scale must be positive")
        if not self.layers:
            raise ValueError("it has no weights0 and biases0")
        for i, (weights, biases) in enumerate(self.layers):
            _check(f"weights{i}", weights, (sizes[-1], weights.shape[-1] if weights.ndim else 0))
            _check(f"biases{i}", biases, (weights.shape[1],))
            sizes.append(weights.shape[1])
        self._check_output(sizes[-1])

    def _check_output(self, size: int) -> None:
        """Check that the outputs of the network fit the actions."""
        bodies, actions = self.header.bodies, self.header.actions
        if (actions == "table") != (self.table is not None):
            raise ValueError('there is a table where actions is "table", and only there')
        if self.table is not None:
            _check("table", self.table, (size, 2 * bodies))
            if not (abs(self.table) <= 1.0).all():
                raise ValueError("table must lie in [-1, 1]")
            return
        expected = bodies * (2 if actions == "effectors" else len(TARGETS))
        if size != expected:
            raise ValueError(f"the last layer has {size} outputs, {actions} need {expected}")

    def outputs(self, observation: NDArray[np.float32]) -> Array:
        """The outputs of the network, shape (outputs,), for an observation, shape (n,)."""
        clip = self.header.clip
        x = np.clip((observation.astype(np.float64) - self.mean) / self.scale, -clip, clip)
        last = len(self.layers) - 1
        for i, (weights, biases) in enumerate(self.layers):
            # Not x @ weights, whose order of summation depends on the machine.
            x = (weights * x[:, None]).sum(axis=0) + biases
            if i < last:
                x = np.maximum(x, 0.0) if self.header.activation == "relu" else np.tanh(x)
        return x

    def efforts(self, observation: NDArray[np.float32]) -> list[tuple[float, float]]:
        """Throttle and steering in [-1, 1] for each body; not for actions "targets"."""
        x = self.outputs(observation)
        if self.table is not None:
            x = self.table[int(np.argmax(x))]
        pairs = np.clip(x, -1.0, 1.0).reshape(self.header.bodies, 2)
        return [(throttle, steering) for throttle, steering in pairs.tolist()]

    def targets(self, observation: NDArray[np.float32]) -> list[int]:
        """The index of the best target for each body; for actions "targets" only."""
        scores = self.outputs(observation).reshape(self.header.bodies, len(TARGETS))
        return [int(best) for best in np.argmax(scores, axis=1)]


Policy = TrainedPolicy  # its name in version 0.1


def read_policy(file: Path) -> TrainedPolicy:
    """The policy in a file; InputError in one sentence when there is none."""
    where = f"policy {str(file)!r}"
    try:
        if file.stat().st_size > LARGEST_B:
            raise InputError(f"{where}: larger than {LARGEST_B >> 20} MB")
        arrays = _arrays(file.read_bytes())
        return _assembled(arrays)
    except OSError as error:
        raise InputError(f"{where}: {error.strerror or error}") from error
    except ValidationError as error:
        raise InputError(f"{where}: header: {first_problem(error)}") from error
    except ValueError as error:
        raise InputError(f"{where}: {' '.join(str(error).split())}") from error


def write_policy(file: Path, policy: TrainedPolicy) -> None:
    """Write a policy; the same policy gives the same bytes."""
    header = np.array(json.dumps(policy.header.model_dump(mode="json")))
    arrays: dict[str, Any] = {"header": header, "mean": policy.mean, "scale": policy.scale}
    for i, (weights, biases) in enumerate(policy.layers):
        arrays |= {f"weights{i}": weights, f"biases{i}": biases}
    if policy.table is not None:
        arrays["table"] = policy.table
    with file.open("wb") as out:  # numpy would add its own ending to a name
        np.savez(out, **arrays)


def _arrays(content: bytes) -> dict[str, NDArray[Any]]:
    """The arrays of an archive; ValueError for any other file."""
    import zipfile

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > LARGEST_B:
                raise ValueError(f"unpacks to more than {LARGEST_B >> 20} MB")
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except Exception as error:  # numpy and zipfile raise all sorts of things over foreign files
        raise ValueError("no .npz archive of plain arrays") from error


def _assembled(arrays: Mapping[str, NDArray[Any]]) -> TrainedPolicy:
    """The policy from the arrays of a file."""
    if "header" not in arrays or arrays["header"].dtype.kind != "U":
        raise ValueError("no policy: it has no header")
    try:
        document = json_of(str(arrays["header"]))
    except ValueError as error:
        raise ValueError(f"its header is no JSON ({error})") from error
    header = Header.model_validate(document)
    depth = sum(name.startswith("weights") for name in arrays)
    layers = [f"{name}{i}" for i in range(depth) for name in ("weights", "biases")]
    wanted = ["mean", "scale", *layers, *(["table"] if header.actions == "table" else [])]
    for name in wanted:
        if name not in arrays:
            raise ValueError(f"it has no {name}")
    for name in arrays:
        if name not in wanted and name != "header":
            raise ValueError(f"it has an array {name!r} that no policy has")
    found = {name: _floats(name, arrays[name]) for name in wanted}
    return TrainedPolicy(
        header,
        found["mean"],
        found["scale"],
        tuple((found[f"weights{i}"], found[f"biases{i}"]) for i in range(depth)),
        found.get("table"),
    )


def _floats(name: str, array: NDArray[Any]) -> Array:
    """An array of numbers in float64."""
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} must hold numbers, got {array.dtype}")
    return array.astype(np.float64)


def _check(name: str, array: Array, shape: Sequence[int]) -> None:
    """Refuse another shape and numbers that are not finite."""
    if array.shape != tuple(shape):
        raise ValueError(f"{name} has the shape {array.shape}, expected {tuple(shape)}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")


def _check_header(header: Header) -> None:
    """Refuse a policy that was trained on other observations or unknown kinds."""
    if header.kind not in KINDS:
        raise ValueError(f"kind {header.kind!r} is none of {', '.join(KINDS)}")
    if header.actions == "targets" and header.kind not in WALKING:
        raise ValueError(f'actions "targets" are for {" and ".join(WALKING)}s only')
    seen = header.observation
    if seen.version != OBSERVATION_VERSION:
        raise ValueError(
            f"trained on version {seen.version} of the observation, this is {OBSERVATION_VERSION}"
        )
    names = tuple(name for name, _, _ in entries(header.bodies, 1.0, 1.0))
    for i, (its, ours) in enumerate(zip(seen.names, names, strict=False)):
        if its != ours:
            raise ValueError(f"entry {i} of its observation is {its!r}, expected {ours!r}")
    if len(seen.names) != len(names):
        raise ValueError(f"its observation has {len(seen.names)} entries, expected {len(names)}")
