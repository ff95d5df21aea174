"""One pass over the elements of a block, as C: from the controls to what a program sums up, nothing of node size kept.

LANES elements at a time, one per vector lane: the rows that the kernel reads are combined from the controls, the kernel
is evaluated at the nodes, and its gradients and Hessians are brought back to the controls and added where they belong.
All sums have the order of `BlockEvaluator`'s, without contraction: the same bits.
"""

import ctypes
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from symmotion.kernels.packing import Packing

# What becomes of what a function returns at the nodes, see `Pass`.
KINDS = {
    **dict.fromkeys(("value", "out", "line", "along", "rounding"), "NODES"),
    "gradient": "SLOPES",
    **dict.fromkeys(("hessian", "barrier"), "MATRIX"),
}
DIRECTED = ("line", "along")  # whose mu is a direction, read as z is

PAIRS, ENTRIES = 3, 8  # of a product in registers


class Pass(ctypes.Structure):
    """What one pass reads and writes; the tables are those of `LocalTables`.

    The elements from first to before end, each of so many nodes and columns; stride: numbers of a control. low, high,
    begin, stop: only the blocks and the controls of these numbers are added to, from the first to before the second. x,
    direction: where the first channel of the first control lies.
    out: (E · Q, …) of functions whose values at the nodes are wanted; gradient: (n, channels), added to; matrix: the
    flat array to which factor times the Hessians are added, where `starts` says, see `Targets`.
    """

    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("first", "end", "low", "high", "begin", "stop")),
        *((name, ctypes.c_longlong) for name in ("nodes", "controls", "reduced", "stride", "mirrored")),
        *((name, ctypes.c_double) for name in ("theta", "factor")),
        *((name, ctypes.c_void_p) for name in ("x", "direction", "columns", "coefficients", "weights", "data", "mu")),
        *((name, ctypes.c_void_p) for name in ("sigma", "out", "gradient", "basis", "places", "starts", "matrix")),
        ("work", ctypes.c_void_p),
    ]


@dataclass(frozen=True)
class Shape:
    """What a pass has to know of a function: its kind (see `derive`), and the channels of what it reads."""

    kind: str
    channels: int

    @property
    def role(self) -> str | None:
        return KINDS.get(self.kind)


def pass_source(shape: Shape, inputs: list[int], outputs: list[int], sizes: list[int], zeros: AbstractSet[int]) -> str:
    """The C text of the pass of a function whose C is `nodes`, see `c_source`; empty where it has none.

    inputs: the sizes of what it reads, zero where it does not; sizes: of its inputs as they are; zeros: which numbers
    of its first output are zero whatever it reads.
    """
    if shape.role is None or sizes[0] == 0:
        return ""
    rows = sizes[0] // shape.channels
    packing = Packing.of(rows, shape.channels)
    head = {
        "CHANNELS": shape.channels,
        "ROWS": rows,
        "OUT": outputs[0],
        **{name: (inputs + [0] * 5)[i] for i, name in enumerate(("READ", "DATA", "MU", "THETA", "SIGMA"))},
        **{role: int(shape.role == role) for role in ("NODES", "SLOPES", "MATRIX")},
        "DIRECTED": int(shape.kind in DIRECTED),
    }
    defines = "".join(f"#define {name} {value}\n" for name, value in head.items())
    arguments = ["z" if inputs[0] else "0", "data" if inputs[1] else "0", "mu" if inputs[2] else "0"]
    arguments += [name if inputs[i] else "0" for i, name in ((3, "theta"), (4, "sigma")) if i < len(inputs)]
    call = ", ".join([*arguments, "h", *(["g"] if len(outputs) > 1 else [])])
    tables = _entries(packing, zeros) if shape.role == "MATRIX" else ""
    return f"{defines}#define EVALUATE(h, g) nodes({call})\n{tables}{_shuffles()}{TEXT}"


def _entries(packing: Packing, zeros: AbstractSet[int]) -> str:
    """Which entries of the parts are not zero always, a multiple of ENTRIES of each, and where they go."""
    parts, size = packing.symmetric
    skews, above = packing.skew
    skew = [e for e in range(above) if any(packing.split + s * above + e not in zeros for s in range(skews))]
    bent = {(int(packing.above[0, e]), int(packing.above[1, e])) for e in skew}
    places = list(zip(*packing.upper.tolist(), strict=True))
    symmetric = [
        e for e in range(size) if places[e] in bent or any(s * size + e not in zeros for s in range(parts))
    ] or [0]
    text = f"#define PAIRS {PAIRS}\n#define ENTRIES {ENTRIES}\n"
    text += f"#define PARTS {parts}\n#define SIZE {size}\n#define SKEWS {skews}\n#define ABOVE {above}\n"
    for name, entries, where in (("S", symmetric, packing.upper), ("A", skew, packing.above)):
        count = -(-len(entries) // ENTRIES) * ENTRIES
        # What fills up the last product is computed twice.
        filled = entries + entries[-1:] * (count - len(entries))
        text += f"#define {name}_COUNT {len(entries)}\n#define {name}_FILLED {count}\n"
        for letter, values in (("E", filled), ("I", where[0][entries].tolist()), ("J", where[1][entries].tolist())):
            text += f"static const short {name}{letter}[] = {{{', '.join(map(str, values)) or '0'}}};\n"
    twins = [symmetric.index(places.index((int(packing.above[0, e]), int(packing.above[1, e])))) for e in skew]
    text += f"static const short AS[] = {{{', '.join(map(str, twins)) or '0'}}};\n"
    text += "".join(
        f"static const short P{letter}[] = {{{', '.join(map(str, values.tolist()))}}};\n"
        for letter, values in zip("AB", packing.pairs, strict=True)
    )
    return text


def _shuffles() -> str:
    """`EXCHANGE(a, b, h)` for vectors of any number of lanes: the step of a transposition between rows h apart."""
    text = ""
    for lanes in (8, 4, 2):
        text += f"{'#if' if lanes == 8 else '#elif'} LANES == {lanes} && defined(SHUFFLES)\n"
        h = lanes // 2
        while h:
            low = [lane if not lane & h else lanes + lane - h for lane in range(lanes)]
            high = [lane + h if not lane & h else lanes + lane for lane in range(lanes)]
            low, high = (", ".join(map(str, part)) for part in (low, high))
            text += f"#define EXCHANGE{h}(a, b) {{ V c = __builtin_shufflevector(a, b, {low}); "
            text += f"b = __builtin_shufflevector(a, b, {high}); a = c; }}\n"
            h //= 2
    return f"""
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define SHUFFLES
#endif
#endif
{text}#endif
"""


TEXT = r"""
typedef struct {
  long long first, end, low, high, begin, stop, nodes, controls, reduced, stride, mirrored;
  double theta, factor;
  const double *x, *direction;
  const long long *columns;
  const double *coefficients, *weights, *data, *mu, *sigma;
  double *out, *gradient;
  const double *basis;
  const long long *places, *starts;
  double *matrix, *work;
} Pass;

#define FILLED(n, by) (((n) + (by) - 1) / (by) * (by))
#define EVERY _Pragma("GCC unroll 32")  /* loops over what registers hold */

/* Of LANES elements: numbers (E, size), a vector for each. */
static inline void load(const double *from, const long long *e, long long size, V *to) {
  for (int l = 0; l < LANES; l++) for (long long j = 0; j < size; j++) to[j][l] = from[e[l] * size + j];
}

static inline void controls(const Pass *p, const double *x, const long long *e, V *to) {
  for (int l = 0; l < LANES; l++) for (long long k = 0; k < p->controls; k++) {
    const double *from = x + p->columns[e[l] * p->controls + k] * p->stride;
    for (int j = 0; j < CHANNELS; j++) to[k * CHANNELS + j][l] = from[j];
  }
}

/* The rows that a node reads: c (ROWS, K) times the controls. */
static inline void rows(const Pass *p, const V *c, const V *x, V *z) {
  for (int r = 0; r < ROWS; r++) {
    V sum[CHANNELS];
    EVERY for (int j = 0; j < CHANNELS; j++) sum[j] = all(0.0);
    for (long long k = 0; k < p->controls; k++)
      EVERY for (int j = 0; j < CHANNELS; j++) sum[j] = sum[j] + c[r * p->controls + k] * x[k * CHANNELS + j];
    EVERY for (int j = 0; j < CHANNELS; j++) z[r * CHANNELS + j] = sum[j];
  }
}

/* Vectors of LANES elements as LANES rows of numbers, `step` apart; count: a multiple of LANES. */
static inline void spread(const V *from, long long count, double *to, long long step) {
  for (long long first = 0; first < count; first += LANES) {
#ifdef SHUFFLES
    V a[LANES];
    EVERY for (int i = 0; i < LANES; i++) a[i] = from[first + i];
#if LANES == 8
    EVERY for (int i = 0; i < 4; i++) EXCHANGE4(a[i], a[i + 4])
#endif
#if LANES >= 4
    EVERY for (int i = 0; i < LANES; i += 4) EVERY for (int j = i; j < i + 2; j++) EXCHANGE2(a[j], a[j + 2])
#endif
    EVERY for (int i = 0; i < LANES; i += 2) EXCHANGE1(a[i], a[i + 1])
    EVERY for (int l = 0; l < LANES; l++) *(T *)(to + l * step + first) = a[l];
#else
    for (int l = 0; l < LANES; l++) for (int i = 0; i < LANES; i++) to[l * step + first + i] = from[first + i][l];
#endif
  }
}

#if MATRIX
/* Weights of the parts, (Q · PARTS, pairs) of every pair of columns and (Q · SKEWS, unlike) of those of two columns;
   missing pairs weigh 0. */
static inline void weigh(const Pass *p, const V *c, const V *w, long long pairs, long long unlike, V *symmetric,
                         V *skew) {
  const long long n = p->reduced;
  for (long long q = 0; q < p->nodes; q++, c += ROWS * n) for (int s = 0; s < PARTS; s++) {
    const V *a = c + PA[s] * n, *b = c + PB[s] * n;
    long long pair = 0, other_pair = 0;
    for (long long u = 0; u < n; u++) for (long long v = u; v < n; v++, pair++) {
      const V one = w[q] * a[u] * b[v];
      if (a == b) { symmetric[pair] = one; continue; }
      const V other = w[q] * b[u] * a[v];
      symmetric[pair] = all(0.5) * (one + other);
      if (u != v) skew[other_pair++] = all(0.5) * (one - other);
    }
    for (; pair < pairs; pair++) symmetric[pair] = all(0.0);
    symmetric += pairs;
    if (a == b) continue;
    for (; other_pair < unlike; other_pair++) skew[other_pair] = all(0.0);
    skew += unlike;
  }
}

/* Sums over nodes and parts of weights times entries: (pairs, count). */
static inline void products(const Pass *p, const V *w, long long pairs, int parts, int begin, int size, const V *h,
                            const short *entry, int count, V *to) {
  for (long long first = 0; first < pairs; first += PAIRS) for (int e = 0; e < count; e += ENTRIES) {
    V sum[PAIRS][ENTRIES];
    EVERY for (int i = 0; i < PAIRS; i++) EVERY for (int j = 0; j < ENTRIES; j++) sum[i][j] = all(0.0);
    const V *weight = w + first;
    for (long long q = 0; q < p->nodes; q++) {
      const V *part = h + q * OUT + begin;
      for (int s = 0; s < parts; s++, part += size, weight += pairs) EVERY for (int j = 0; j < ENTRIES; j++) {
        const V value = part[entry[e + j]];
        EVERY for (int i = 0; i < PAIRS; i++) sum[i][j] = sum[i][j] + weight[i] * value;
      }
    }
    EVERY for (int i = 0; i < PAIRS; i++) EVERY for (int j = 0; j < ENTRIES; j++)
      to[(first + i) * count + e + j] = sum[i][j];
  }
}

#define BLOCK (CHANNELS * CHANNELS)

/* Both sums of every pair as a block, row by row, or column by column with `mirrored`. */
static inline void blocks(const Pass *p, const V *symmetric, const V *skew, V *to) {
  const V factor = all(p->factor);
  const int row = p->mirrored ? 1 : CHANNELS, column = p->mirrored ? CHANNELS : 1;
  for (long long u = 0; u < p->reduced; u++) for (long long v = u; v < p->reduced; v++) {
    for (int e = 0; e < S_COUNT; e++)
      to[SI[e] * row + SJ[e] * column] = to[SJ[e] * row + SI[e] * column] = factor * symmetric[e];
    if (u != v) {
      for (int e = 0; e < A_COUNT; e++) {
        const V sum = symmetric[AS[e]];
        to[AI[e] * row + AJ[e] * column] = factor * (sum + skew[e]);
        to[AJ[e] * row + AI[e] * column] = factor * (sum - skew[e]);
      }
      skew += A_FILLED;
    }
    to += BLOCK;
    symmetric += S_FILLED;
  }
}

/* The blocks of one element into the matrix, of those on its diagonal one triangle. */
static inline void add(const Pass *p, long long e, const double *t) {
  const long long n = p->reduced, *place = p->places + e * (n * (n + 1) / 2);
  for (long long u = 0; u < n; u++) for (long long v = u; v < n; v++, place++, t += BLOCK) {
    if (*place < p->low || *place >= p->high) continue;
    const long long *start = p->starts + *place * CHANNELS;
    if (u != v) for (int i = 0; i < CHANNELS; i++) {
      double *to = p->matrix + start[i];
      int j = 0;
      for (; j + LANES <= CHANNELS; j += LANES) *(T *)(to + j) = *(T *)(to + j) + *(T *)(t + i * CHANNELS + j);
      for (; j < CHANNELS; j++) to[j] += t[i * CHANNELS + j];
    } else for (int i = 0; i < CHANNELS; i++) {
      double *to = p->matrix + start[i];
      const int begin = p->mirrored ? 0 : i, end = p->mirrored ? i + 1 : CHANNELS;
      for (int j = begin; j < end; j++) to[j] += t[i * CHANNELS + j];
    }
  }
}
#endif

/* The work of an element group; with p->work NULL only how many numbers it takes. */
long long pass(const Pass *p) {
  const long long Q = p->nodes, K = p->controls;
  V *at = (V *)(((unsigned long long)p->work + sizeof(V) - 1) / sizeof(V) * sizeof(V));
  V *const begin = at;
#define TAKE(name, size) V *const name = at; at += (size)
  TAKE(c, Q * ROWS * K);
  TAKE(x, K * CHANNELS);
  TAKE(z, ROWS * CHANNELS);
  TAKE(w, Q);
  TAKE(data, DATA + 1);
  TAKE(mu, MU + 1);
  TAKE(sigma, SIGMA + 1);
  TAKE(theta, 1);
#if DIRECTED
  TAKE(direction, K * CHANNELS);
#endif
  TAKE(h, (NODES ? 1 : Q) * OUT);
#if SLOPES || MATRIX
  const long long wide = FILLED(K * CHANNELS, LANES);
  TAKE(slopes, wide);
  TAKE(apart, wide);
#endif
#if MATRIX
  const long long n = p->reduced, pairs = n * (n + 1) / 2, filled = FILLED(pairs, PAIRS);
  const long long unlike = FILLED(n * (n - 1) / 2, PAIRS);
  const long long all_blocks = FILLED(pairs * BLOCK, LANES);
  TAKE(g, Q * ROWS * CHANNELS);
  TAKE(basis, Q * ROWS * n);
  TAKE(symmetric, Q * PARTS * filled);
  TAKE(skew, Q * SKEWS * unlike);
  TAKE(straight, filled * S_FILLED);
  TAKE(crossed, unlike * A_FILLED);
  TAKE(block, all_blocks);
  TAKE(spread_blocks, all_blocks);
#elif SLOPES
  V *const g = h;
#endif
  if (!p->work) return (at - begin + 1) * LANES;
#if MATRIX
  for (long long i = 0; i < all_blocks; i++) block[i] = all(0.0);
#endif
#if SLOPES || MATRIX
  for (long long i = K * CHANNELS; i < wide; i++) slopes[i] = all(0.0);
#endif
  theta[0] = all(p->theta);
  for (long long first = p->first; first < p->end; first += LANES) {
    const int live = p->end - first < LANES ? (int)(p->end - first) : LANES;
    /* Lanes past the end repeat the last element and are not stored. */
    long long e[LANES];
    for (int l = 0; l < LANES; l++) e[l] = first + (l < live ? l : live - 1);
    load(p->coefficients, e, Q * ROWS * K, c);
    controls(p, p->x, e, x);
#if DIRECTED
    controls(p, p->direction, e, direction);
#endif
    for (long long q = 0; q < Q; q++) {
      long long node[LANES];
      for (int l = 0; l < LANES; l++) node[l] = e[l] * Q + q;
      if (READ) rows(p, c + q * ROWS * K, x, z);
      if (DATA) load(p->data, node, DATA, data);
#if DIRECTED
      if (MU) rows(p, c + q * ROWS * K, direction, mu);
#else
      if (MU) load(p->mu, node, MU, mu);
#endif
      if (SIGMA) load(p->sigma, node, SIGMA, sigma);
#if NODES
      EVALUATE(h, 0);
      for (int l = 0; l < live; l++) for (int j = 0; j < OUT; j++) p->out[node[l] * OUT + j] = h[j][l];
#else
      EVALUATE(h + q * OUT, g + q * ROWS * CHANNELS);
#endif
    }
#if SLOPES || MATRIX
    load(p->weights, e, Q, w);
    for (long long i = 0; i < K * CHANNELS; i++) slopes[i] = all(0.0);
    for (long long q = 0; q < Q; q++) for (int r = 0; r < ROWS; r++) {
      V weighted[CHANNELS];
      for (int j = 0; j < CHANNELS; j++) weighted[j] = g[(q * ROWS + r) * CHANNELS + j] * w[q];
      for (long long k = 0; k < K; k++) for (int j = 0; j < CHANNELS; j++)
        slopes[k * CHANNELS + j] = slopes[k * CHANNELS + j] + c[(q * ROWS + r) * K + k] * weighted[j];
    }
    spread(slopes, wide, (double *)apart, wide);
    for (int l = 0; l < live; l++) for (long long k = 0; k < K; k++) {
      const long long column = p->columns[e[l] * K + k];
      if (column < p->begin || column >= p->stop) continue;
      double *to = p->gradient + column * CHANNELS, *from = (double *)apart + l * wide;
      for (int j = 0; j < CHANNELS; j++) to[j] += from[k * CHANNELS + j];
    }
#endif
#if MATRIX
    load(p->basis, e, Q * ROWS * n, basis);
    weigh(p, basis, w, filled, unlike, symmetric, skew);
    products(p, symmetric, filled, PARTS, 0, SIZE, h, SE, S_FILLED, straight);
    products(p, skew, unlike, SKEWS, PARTS * SIZE, ABOVE, h, AE, A_FILLED, crossed);
    blocks(p, straight, crossed, block);
    spread(block, all_blocks, (double *)spread_blocks, all_blocks);
    for (int l = 0; l < live; l++) add(p, e[l], (double *)spread_blocks + l * all_blocks);
#endif
  }
  return 0;
}
"""


class ElementFunction:
    """The pass of a kernel function as machine code; safe to call from several threads."""

    def __init__(self, library: ctypes.CDLL):
        self._call = library["pass"]
        self._call.argtypes, self._call.restype = (ctypes.POINTER(Pass),), ctypes.c_longlong

    def work(self, task: Pass) -> np.ndarray:
        """Memory for a pass of these sizes, which is told of it."""
        task.work = None
        memory = np.empty(self._call(ctypes.byref(task)))
        task.work = memory.ctypes.data
        return memory

    def __call__(self, task: Pass) -> None:
        self._call(ctypes.byref(task))
