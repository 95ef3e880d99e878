"""Pictures as an animated GIF (Pillow) and as an MP4 (ffmpeg, where there is one)."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

from strainbench.render.film import Track, untracked

STILL = 0.1  # [s] a frame of a scene that has no clock
FASTEST = 0.02  # [s]: browsers slow down what is shorter


def durations(frames: int, interval: float | None) -> list[int]:
    """(frames,) milliseconds each is shown: in real time on the whole, in a GIF's 10 ms units."""
    interval = max(FASTEST, STILL if interval is None else interval)
    ends = [round(100 * interval * (k + 1)) for k in range(frames)]
    return [10 * (end - start) for start, end in zip([0, *ends], ends, strict=False)]


def write_gif(
    path: Path, pictures: Sequence[Path], interval: float | None, track: Track = untracked
) -> Path:
    """An endless GIF; all frames share one palette, so that a colour means the same in each."""
    palette = _palette(pictures[:: max(1, len(pictures) // 6)])

    def coloured(picture: Path) -> Image.Image:
        with Image.open(picture) as image:
            return image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE)

    rest = (coloured(p) for p in track(pictures[1:], "writing GIF", len(pictures) - 1))
    coloured(pictures[0]).save(
        path,
        save_all=True,
        append_images=rest,
        duration=durations(len(pictures), interval),
        loop=0,
        optimize=False,
    )
    return path


def _palette(pictures: Sequence[Path]) -> Image.Image:
    """256 colours for all of `pictures`."""
    images = [Image.open(picture).convert("RGB") for picture in pictures]
    width, height = images[0].size
    together = Image.new("RGB", (width, height * len(images)))
    for k, image in enumerate(images):
        together.paste(image, (0, k * height))
    return together.quantize(256, method=Image.Quantize.MEDIANCUT)


def write_mp4(
    path: Path, pictures: Sequence[Path], interval: float | None, track: Track = untracked
) -> Path | None:
    """An H.264 video in real time, or None where there is no ffmpeg.

    Raises
    ------
    ValueError
        If ffmpeg fails, with the last line it says.
    """
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg is None:
        return None
    rate = f"{1 / (STILL if interval is None else interval):.6g}"
    given = ["-f", "image2pipe", "-framerate", rate, "-c:v", "png", "-i", "-"]
    wanted = ["-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    command = [ffmpeg, "-y", "-loglevel", "error", *given, *wanted, str(path)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdin is not None
    try:
        for picture in track(pictures, "writing MP4", len(pictures)):
            process.stdin.write(picture.read_bytes())
    except BrokenPipeError:
        pass  # its own words say more
    _, words = process.communicate()
    if process.returncode:
        lines = words.decode(errors="replace").strip().splitlines() or ["no reason given"]
        raise ValueError(f"--format mp4: ffmpeg failed: {lines[-1]}")
    return path
