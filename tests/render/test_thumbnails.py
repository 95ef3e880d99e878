"""Every scene has a small picture, and README shows it with a text in its place."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image

from strainbench.render.thumbnails import SHOTS, SIZE, main, take
from strainbench.scenario.registry import list_scenarios
from tests.imports import HERE

SCENES = [scene.name for scene in list_scenarios() if scene.name != "instance"]  # of a file


def test_every_scene_has_a_small_thumbnail_in_the_readme():
    readme = (HERE / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"!\[([^\]]+)\]\(results/thumbnails/([a-z-]+)\.png\)", readme)
    assert sorted(name for _, name in shown) == sorted(SCENES)
    assert all(len(alt) > 20 for alt, _ in shown)
    for name in SCENES:
        path = HERE / "results" / "thumbnails" / f"{name}.png"
        assert path.stat().st_size < 16_000
        with Image.open(path) as image:
            assert image.size == SIZE


def test_shots_are_of_scenes_that_there_are():
    assert set(SHOTS) <= set(SCENES)


def test_a_thumbnail_shows_the_scene(tmp_path):
    path = take("stretch-square", tmp_path)
    pixels = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert np.all(pixels[0, 0] == 255)
    middle = pixels[SIZE[1] // 2, SIZE[0] // 2]
    assert np.ptp(middle) > 40


@pytest.mark.parametrize(
    ("scenes", "output", "line"),
    [(["swim"], "new", "no scenario called 'swim'"), (["swing"], "file/x", "cannot be written to")],
)
def test_a_wrong_word_is_one_line(scenes, output, line, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit, match=line):
        main(scenes, tmp_path / output)
