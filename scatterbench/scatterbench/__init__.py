"""ScatterBench: see, learn, predict and plan strikes that scatter piles of objects.

An adapter answers items; `score` compares the answers with the truth, which no adapter is given::

    from scatterbench import score, split
    from scatterbench.adapters import random

    data = split("dev")
    submission = {"version": 1, "split": "dev", "method": "random", "answers": {item["id"]: random.answer(item) for item in data.items}}
    print(score(submission, data))
"""

from .scoring import markdown, score
from .tasks import Split, split

__all__ = ["Split", "markdown", "score", "split"]
__version__ = "0.1.0"
