"""Many programs: here, in other processes or on a cluster, with a results file that goes on where it stopped."""

from symmotion.batches.many import Tally, solve_each, solve_many
from symmotion.batches.results_file import ResultsFile
from symmotion.batches.workers import Failed, own_processes

__all__ = [
    "Failed",
    "ResultsFile",
    "Tally",
    "own_processes",
    "solve_each",
    "solve_many",
]
