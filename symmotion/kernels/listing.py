"""Kernel functions as lists of instructions for a machine of our own, which carries each out on many nodes at once.

CasADi's machine reads the list anew for every node, and compilers take minutes for lists of a hundred thousand
instructions. This machine is compiled once for all lists and holds NODES nodes in every register: the same operations
in the same order, and so the same bits.
"""

from dataclasses import dataclass, fields

import casadi as ca
import numpy as np

from symmotion.kernels.source import ARITHMETIC, BY_LANE, HEAD

# A list of 60,000 instructions with some thousand registers: 8 nodes take 1.6 times as long, 32 as long as 16.
NODES = 16


@dataclass(frozen=True, eq=False)
class Listing:
    """A function's instructions.

    code: (K, 4) operation, then register, inputs; of an input the register, the input and the element, of an output
    the output, the register and the element. constants: (C,) that are named by their place. inputs: the size of each
    input, zero where it is not read; outputs: of each output. registers: (1,) how many there are.
    """

    code: np.ndarray
    constants: np.ndarray
    inputs: np.ndarray
    outputs: np.ndarray
    registers: np.ndarray

    def __repr__(self) -> str:
        return f"Listing({len(self.code)} instructions)"

    @staticmethod
    def of(function: ca.Function) -> "Listing | None":
        """The instructions of a dense SX function; None where one has no C form here."""
        code, constants, read = np.zeros((function.n_instructions(), 4), dtype=np.int64), [], set()
        for k in range(len(code)):
            op = function.instruction_id(k)
            given, made = function.instruction_input(k), function.instruction_output(k)
            if op == ca.OP_CONST:
                code[k] = op, made[0], len(constants), 0
                constants.append(function.instruction_constant(k))
            elif op == ca.OP_INPUT:
                code[k] = op, made[0], given[0], given[1]
                read.add(given[0])
            elif op == ca.OP_OUTPUT:
                code[k] = op, made[0], given[0], made[1]
            elif op in ARITHMETIC or op in BY_LANE:
                code[k] = op, made[0], given[0], given[-1]
            else:
                return None
        inputs = [function.size1_in(i) if i in read else 0 for i in range(function.n_in())]
        outputs = [function.size1_out(i) for i in range(function.n_out())]
        whole = (np.array(part, dtype=np.int64) for part in (inputs, outputs, [function.sz_w()]))
        return Listing(code, np.array(constants, dtype=float), *whole)

    def to_bytes(self) -> bytes:
        """The list as a file holds it: the sizes of its arrays, and the arrays."""
        parts = [getattr(self, f.name) for f in fields(self)]
        return np.array([a.size for a in parts], dtype=np.int64).tobytes() + b"".join(a.tobytes() for a in parts)

    @staticmethod
    def from_bytes(data: bytes) -> "Listing":
        """The inverse of `to_bytes`."""
        sizes, start, parts = np.frombuffer(data, dtype=np.int64, count=len(fields(Listing))), 0, []
        start = sizes.nbytes
        for f, size in zip(fields(Listing), sizes.tolist(), strict=True):
            kind = np.float64 if f.name == "constants" else np.int64
            parts.append(np.frombuffer(data, dtype=kind, count=size, offset=start))
            start += parts[-1].nbytes
        return Listing(parts[0].reshape(-1, 4), *parts[1:])


def machine_source() -> str:
    """The C text of the machine.

    `void run(count, in, out, length, code, constants, inputs, outputs, registers)` reads inputs (count, size) each and
    writes outputs (count, size) each, row by row, as `c_source` says; registers: (number of registers, NODES).
    """
    vectors = f"#define LANES {NODES}\n" + HEAD[HEAD.index("#define EACH") :]
    # Registers lie wherever NumPy puts them.
    vectors = vectors.replace("vector_size(8 * LANES)))", "vector_size(8 * LANES), aligned(8)))")
    cases = "".join(
        f"      case {op}: w[c[1]] = {text.format(x='w[c[2]]', y='w[c[3]]')}; break;\n"
        for op, text in ARITHMETIC.items()
    )
    by_lane = "".join(
        f"      case {op}: for (int l = 0; l < LANES; l++) {{ double x = w[c[2]][l], y = w[c[3]][l]; (void)y; "
        f"r[l] = {text}; }} w[c[1]] = r; break;\n"
        for op, text in BY_LANE.items()
    )
    return f"""{vectors}
void run(long count, const double *const *in, double *const *out, long length, const long long *code,
         const double *constants, const long long *inputs, const long long *outputs, V *w) {{
  V r;
  for (long first = 0; first < count; first += LANES) {{
    const int live = count - first < LANES ? (int)(count - first) : LANES;
    // Lanes past the end repeat the last node and are not stored.
    long n[LANES];
    for (int l = 0; l < LANES; l++) n[l] = first + (l < live ? l : live - 1);
    for (const long long *c = code, *end = code + 4 * length; c < end; c += 4) switch (c[0]) {{
      case {ca.OP_CONST}: w[c[1]] = all(constants[c[2]]); break;
      case {ca.OP_INPUT}:
        for (int l = 0; l < LANES; l++) r[l] = in[c[2]][n[l] * inputs[c[2]] + c[3]];
        w[c[1]] = r; break;
      case {ca.OP_OUTPUT}:
        for (int l = 0; l < live; l++) out[c[1]][n[l] * outputs[c[1]] + c[3]] = w[c[2]][l];
        break;
{cases}{by_lane}    }}
  }}
}}
"""
