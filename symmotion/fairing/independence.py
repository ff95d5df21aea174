"""Whether the keyframes of a net can be met together: rank, and which of them ask for too much."""

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from symmotion.errors import InputError
from symmotion.fairing.keyframes import Held

# Singular values of the equations, rows of length 1, that are as good as zero; residuals that are.
DEPENDENT, MET = 1e-10, 1e-9


def independent(keyframes: Sequence[Held], start: np.ndarray, basis: sparse.csr_array) -> tuple[int, ...]:
    """The keyframes that say something about the free coordinates y of a net x = start + basis y.

    Raises InputError that names keyframes among controls that stay, and ones whose equations depend on each other.
    """
    flat = start.reshape(-1, start.shape[-1])
    active, plain = [], True
    seen: dict[tuple[bytes, bytes, int], Held] = {}
    for i, k in enumerate(keyframes):
        if not len(k.target):
            continue
        # One displacement at one place twice, which is known to be the same: with a weight, where that is too.
        first = seen.setdefault((k.combos.indices.tobytes(), k.combos.data.tobytes(), len(k.target)), k)
        both = first is not k and k.displacement is not None and first.displacement is not None
        if both and np.abs(np.abs(first.target) - np.abs(k.target)).max() < MET:
            continue
        rows = k.combos @ basis
        if not abs(rows).sum():
            wanting = k.target - np.einsum("ekc,kc->e", k.form, k.combos @ flat)
            if np.abs(wanting).max() > MET * max(1.0, float(np.abs(flat).max())):
                raise InputError(f"{k.label} reads only controls that stay, and is not met by them")
            continue
        plain = plain and k.combos.shape[0] == 1
        active.append(i)
    if active and not (plain and _full(sparse.vstack([keyframes[i].combos @ basis for i in active]))):
        _require_rank([keyframes[i] for i in active], basis)
    return tuple(active)


def _full(rows: sparse.csr_array) -> bool:
    """Whether rows (E, N) are independent."""
    dense = _dense(rows)
    if dense.shape[0] > dense.shape[1]:
        return False
    return bool(np.linalg.svd(dense, compute_uv=False)[-1] > DEPENDENT)


def _dense(rows: sparse.csr_array) -> np.ndarray:
    """(E, touched) the columns that are read, rows of length 1."""
    rows = sparse.csr_array(rows)
    dense = rows[:, np.unique(rows.indices)].toarray()
    return dense / np.maximum(np.linalg.norm(dense, axis=1, keepdims=True), 1e-300)


def _require_rank(held: Sequence[Held], basis: sparse.csr_array) -> None:
    """InputError that names the keyframes whose equations depend on each other."""
    rows = sparse.vstack([equations(k, basis) for k in held])
    dense = _dense(rows)
    u, s, _ = np.linalg.svd(dense)
    rank = int((s > DEPENDENT).sum())
    if rank == len(dense):
        return
    share = np.linalg.norm(u[:, rank:], axis=1)
    owner = np.repeat(np.arange(len(held)), [len(k.target) for k in held])
    guilty = [held[i].label for i in np.unique(owner[share > 1e-6 * share.max()])]
    shown = ", ".join(g.removeprefix("keyframe ") for g in guilty[:8]) + (", …" if len(guilty) > 8 else "")
    total = sum(len(k.target) for k in held if k.label in guilty)
    raise InputError(
        f"keyframes {shown} are too crowded for the net: of their {total} equations {len(dense) - rank} depend on the "
        f"others (rank {rank} of {len(dense)}); drop some, or give the net more controls there"
    )


def equations(k: Held, basis: sparse.csr_array | None = None) -> sparse.csr_array:
    """(e, N C) the equations of a keyframe on the coordinates x, or on y of x = basis y, channel by channel of each."""
    combos = k.combos if basis is None else sparse.csr_array(k.combos @ basis)
    units = np.eye(k.form.shape[2])
    parts = [
        sparse.kron(sparse.csr_array(k.form[..., c]) @ combos, units[[c]], format="csr") for c in range(len(units))
    ]
    return sparse.csr_array(sum(parts[1:], parts[0]))
