"""Figures as files: small, and as sharp as with all colours."""

import numpy as np
from PIL import Image

from myowave.plotting import BLUE, MODEL, canvas, save


def test_a_picture_keeps_its_colours_and_is_the_same_each_time(tmp_path):
    for name in ("one.png", "two.png"):
        figure, axes = canvas(1, 1)
        axes[0, 0].plot([0, 1], [0, 1], color=MODEL, linewidth=6)
        axes[0, 0].fill_between([0, 1], 0.2, 0.4, color=BLUE)
        save(figure, tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()
    with Image.open(tmp_path / "one.png") as image:
        assert image.mode == "P" and round(image.info["dpi"][0]) == 160
        seen = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    for color in (MODEL, BLUE, "#ffffff"):
        wanted = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
        assert (np.abs(seen - wanted).max(1) <= 2).sum() > 500, color


def test_other_formats_are_written_as_their_ending_says(tmp_path):
    figure, _ = canvas(1, 1)
    save(figure, tmp_path / "figure.svg")
    assert "<svg" in (tmp_path / "figure.svg").read_text()
