"""Adapters: each module has `answer(item)`, which gives the answer to one item, or `None` for a task that it does not do."""

NAMES = ("random", "breakshot", "opencv_scipy", "mujoco_default", "pymunk_planar", "wrong")
