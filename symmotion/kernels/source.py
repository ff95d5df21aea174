"""Kernel functions as C: one straight-line program that works on several nodes at once, a node per vector lane."""

import math

import casadi as ca

from symmotion.kernels.passes import Shape, pass_source

# Operations of two operands, or of one, in terms of vectors x and y. Rounded as CasADi's own machine rounds
# them, one IEEE operation each, so that compiled and interpreted kernels return the same bits.
ARITHMETIC: dict[int, str] = {
    ca.OP_ASSIGN: "{x}",
    ca.OP_ADD: "{x} + {y}",
    ca.OP_SUB: "{x} - {y}",
    ca.OP_MUL: "{x} * {y}",
    ca.OP_DIV: "{x} / {y}",
    ca.OP_NEG: "-{x}",
    ca.OP_SQ: "{x} * {x}",
    ca.OP_TWICE: "{x} + {x}",
    ca.OP_FABS: "(V)((M)({x}) & 0x7fffffffffffffffLL)",
    ca.OP_INV: "all(1.0) / {x}",
    ca.OP_LT: "where((M)({x} < {y}), all(1.0))",
    ca.OP_LE: "where((M)({x} <= {y}), all(1.0))",
    ca.OP_EQ: "where((M)({x} == {y}), all(1.0))",
    ca.OP_NE: "where((M)({x} != {y}), all(1.0))",
    ca.OP_NOT: "where((M)({x} == all(0.0)), all(1.0))",
    ca.OP_IF_ELSE_ZERO: "where((M)({x} != all(0.0)), {y})",
}
# The rest lane by lane, in terms of numbers x and y.
BY_LANE: dict[int, str] = {
    ca.OP_SQRT: "sqrt(x)",
    ca.OP_SIN: "sin(x)",
    ca.OP_COS: "cos(x)",
    ca.OP_TAN: "tan(x)",
    ca.OP_ASIN: "asin(x)",
    ca.OP_ACOS: "acos(x)",
    ca.OP_ATAN: "atan(x)",
    ca.OP_SINH: "sinh(x)",
    ca.OP_COSH: "cosh(x)",
    ca.OP_TANH: "tanh(x)",
    ca.OP_ASINH: "asinh(x)",
    ca.OP_ACOSH: "acosh(x)",
    ca.OP_ATANH: "atanh(x)",
    ca.OP_EXP: "exp(x)",
    ca.OP_EXPM1: "expm1(x)",
    ca.OP_LOG: "log(x)",
    ca.OP_LOG1P: "log1p(x)",
    ca.OP_ERF: "erf(x)",
    ca.OP_FLOOR: "floor(x)",
    ca.OP_CEIL: "ceil(x)",
    ca.OP_SIGN: "x < 0 ? -1 : x > 0 ? 1 : x",
    ca.OP_POW: "pow(x, y)",
    ca.OP_CONSTPOW: "pow(x, y)",
    ca.OP_ATAN2: "atan2(x, y)",
    ca.OP_HYPOT: "hypot(x, y)",
    ca.OP_FMIN: "fmin(x, y)",
    ca.OP_FMAX: "fmax(x, y)",
    ca.OP_FMOD: "fmod(x, y)",
    ca.OP_COPYSIGN: "copysign(x, y)",
    ca.OP_AND: "x && y",
    ca.OP_OR: "x || y",
}

HEAD = """\
#include <math.h>
#if defined(__AVX512F__)
#define LANES 8
#elif defined(__AVX__)
#define LANES 4
#else
#define LANES 2
#endif
#define EACH(lanes, size) for (int l = 0; l < lanes; l++) for (int j = 0; j < size; j++)
typedef double V __attribute__((vector_size(8 * LANES)));
typedef double T __attribute__((vector_size(8 * LANES), aligned(8)));
typedef long long M __attribute__((vector_size(8 * LANES)));
static inline V all(double x) { V r; for (int l = 0; l < LANES; l++) r[l] = x; return r; }
static __attribute__((noinline)) V where(M mask, V x) { return (V)(mask & (M)x); }
"""


def c_source(function: ca.Function, shape: Shape | None = None) -> str | None:
    """The C text of a dense SX function, mapped over nodes; None where it has an operation without C form here.

    `void kernel(long count, const double *const *in, double *const *out)` reads inputs (count, size)
    each and writes outputs (count, size) each, row by row; an input that it does not read may be
    NULL. `const long sizes[]` has how many inputs there are, the size of each, zero where it is
    not read, and the same for the outputs. shape: where known, there may be a `pass` over elements, too.
    """
    lanes: dict[int, str] = {}
    body: list[str] = []
    read, zeros, zero = set(), set(), set()
    for k in range(function.n_instructions()):
        line = _instruction(function, k, lanes)
        if line is None:
            return None
        op, given, made = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_INPUT:
            read.add(given[0])
        if op == ca.OP_OUTPUT and made[0] == 0 and given[0] in zero:
            zeros.add(made[1])
        # Registers that hold zero.
        zero -= set(made)
        if op == ca.OP_CONST and function.instruction_constant(k) == 0:
            zero.add(made[0])
        body.append(line)
    inputs = [function.size1_in(i) if i in read else 0 for i in range(function.n_in())]
    outputs = [function.size1_out(i) for i in range(function.n_out())]
    # Not inlined: compilers take several times as long with the lanes of a thousand calls unrolled.
    helpers = "".join(
        f"static __attribute__((noinline)) V op{op}(V a, V b) {{ V r; for (int l = 0; l < LANES; l++) "
        f"{{ double x = a[l], y = b[l]; r[l] = {text}; }} return r; }}\n"
        for op, text in sorted(lanes.items())
    )
    sizes = ", ".join(map(str, (len(inputs), *inputs, len(outputs), *outputs)))
    work = [f"a{i}" for i in range(function.sz_w())]
    plain = f"{HEAD}const long sizes[] = {{{sizes}}};\n{helpers}{_nodes(inputs, outputs, work, body)}"
    whole = [function.size1_in(i) for i in range(function.n_in())]
    return plain + (pass_source(shape, inputs, outputs, whole, zeros) if shape else "")


def _nodes(inputs: list[int], outputs: list[int], work: list[str], body: list[str]) -> str:
    """The function at LANES nodes, and over many of them."""
    arguments = [f"const V *restrict x{i}" for i in range(len(inputs))]
    arguments += [f"V *restrict y{i}" for i in range(len(outputs))]
    loads = "".join(
        f"    EACH(LANES, {size}) x{i}[j][l] = in[{i}][n[l] * {size} + j];\n" for i, size in enumerate(inputs) if size
    )
    stores = "".join(
        f"    EACH(live, {size}) out[{i}][n[l] * {size} + j] = y{i}[j][l];\n" for i, size in enumerate(outputs)
    )
    names = [f"x{i}[{max(size, 1)}]" for i, size in enumerate(inputs)]
    names += [f"y{i}[{size}]" for i, size in enumerate(outputs)]
    given = ", ".join([f"x{i}" for i in range(len(inputs))] + [f"y{i}" for i in range(len(outputs))])
    # Lanes past the end repeat the last node and are not stored.
    return f"""
static __attribute__((noinline)) void nodes({", ".join(arguments)}) {{
  V {", ".join(work or ["none"])};
{"".join(line + chr(10) for line in body)}}}

void kernel(long count, const double *const *in, double *const *out) {{
  V {", ".join(names)};
  for (long first = 0; first < count; first += LANES) {{
    const int live = count - first < LANES ? (int)(count - first) : LANES;
    long n[LANES];
    for (int l = 0; l < LANES; l++) n[l] = first + (l < live ? l : live - 1);
{loads}    nodes({given});
{stores}  }}
}}
"""


def _instruction(function: ca.Function, k: int, lanes: dict[int, str]) -> str | None:
    op = function.instruction_id(k)
    inputs, outputs = function.instruction_input(k), function.instruction_output(k)
    if op == ca.OP_CONST:
        return f"    a{outputs[0]} = all({_number(function.instruction_constant(k))});"
    if op == ca.OP_INPUT:
        return f"    a{outputs[0]} = x{inputs[0]}[{inputs[1]}];"
    if op == ca.OP_OUTPUT:
        return f"    y{outputs[0]}[{outputs[1]}] = a{inputs[0]};"
    operands = [f"a{i}" for i in inputs]
    if op in ARITHMETIC:
        return f"    a{outputs[0]} = " + ARITHMETIC[op].format(x=operands[0], y=operands[-1]) + ";"
    if op in BY_LANE:
        lanes[op] = BY_LANE[op]
        return f"    a{outputs[0]} = op{op}({operands[0]}, {operands[-1]});"
    return None


def _number(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return value.hex()
