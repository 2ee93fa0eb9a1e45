"""The notebook runs, and its figures show themselves; values without anything to draw show their text."""

from __future__ import annotations

import base64
from pathlib import Path
from xml.etree import ElementTree

import pytest

import breakshot

TOUR = Path(__file__).parents[1] / "examples" / "tour.ipynb"


def test_values_show_themselves(demo_scene, demo_properties):
    plan = breakshot.plan(demo_scene, demo_properties, method="paper")
    for figure in (demo_scene._repr_svg_(), plan._repr_svg_()):
        assert ElementTree.fromstring(figure).tag.endswith("svg")
    pictures = ElementTree.fromstring(f"<div>{demo_properties._repr_html_()}</div>").iter("img")
    drawings = [base64.b64decode(picture.attrib["src"].partition("base64,")[2]) for picture in pictures]
    assert len(drawings) == 5 and all(ElementTree.fromstring(drawing).tag.endswith("svg") for drawing in drawings)
    empty = breakshot.Tracks.from_json('{"version": 1, "video": "x.mp4", "tracks": [], "reprojection_rms_px": 0.0, "warnings": []}')
    assert empty._repr_svg_() is None


def test_the_tour_runs_and_shows_its_figures():
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    tour = nbformat.read(TOUR, as_version=4)
    assert all(cell.outputs == [] for cell in tour.cells if cell.cell_type == "code"), "outputs are not kept"
    nbclient.NotebookClient(tour, timeout=120, resources={"metadata": {"path": str(TOUR.parent)}}).execute()
    shown = [kind for cell in tour.cells if cell.cell_type == "code" for output in cell.outputs for kind in output.get("data", {})]
    assert shown.count("image/svg+xml") == 4 and shown.count("text/html") == 1, shown
    printed = "".join(output.get("text", "") for cell in tour.cells if cell.cell_type == "code" for output in cell.outputs)
    assert "found: succeeds in" in printed and "goal fulfilled in" in printed
