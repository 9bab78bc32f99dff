"""What holds the gallery's stored output against what examples print and draw."""

from pathlib import Path

import stored_output
from PIL import Image

ROOT = Path(__file__).parents[2]


def test_stored_output_is_held_by_words_numbers_and_looks():
    said = "wall-1   0.6429 +- 1e-12   24 steps  -- falls\n"
    same = (said, said.replace("   ", " "), said.replace("0.6429", "0.6430"), said.replace("1e-12", "3e-09"))
    other = (
        said.replace("0.6429", "0.6431"), said.replace("24 steps", "25 steps"), said.replace("falls", "holds"),
        said.replace("wall-1", "wall-2"), said.replace("1e-12", "1e-05"), said.replace("0.6429", "-0.6429"),
        said.replace("0.6429", "nan"), said + said, "",
    )
    assert not any(stored_output.differences(text, said) for text in same)
    assert all(stored_output.differences(text, said) for text in other)
    seconds = "dem              0.32812  0.3281 to 0.3350  solved   8.9"
    assert not stored_output.differences(seconds.replace("8.9", "18.2"), seconds, "three_theories_one_wall")
    assert stored_output.differences(seconds.replace("0.3350", "0.3360"), seconds, "three_theories_one_wall")
    assert stored_output.same_number("1.972e+04", "1.973e+04")
    assert stored_output.same_number("1", "0.999")
    assert not stored_output.same_number("1e-05", "1e-04")
    assert not stored_output.same_number("1.972e+04", "1.974e+04")
    white = Image.new("RGB", (900, 600), "white")
    line = white.copy()
    line.paste((0, 0, 0), (0, 300, 300, 303))  # three pixels thick, over a third of the width
    assert stored_output.unlikeness(white, white.copy()) == 0.0
    assert stored_output.unlikeness(line, white) > 10 * stored_output.ALIKE
    assert all((ROOT / "examples" / f"{name}.py").is_file() for name in stored_output.MACHINES)


def test_a_thin_coloured_line_keeps_its_colour_beside_many_shades(tmp_path):
    orange, picture = (213, 94, 0), Image.new("RGB", (900, 900))
    picture.putdata([(x // 4,) * 3 for _ in range(900) for x in range(900)])
    picture.paste(orange, (100, 400, 300, 402))
    picture.save(tmp_path / "shades.png")
    kept = stored_output.reduced(tmp_path / "shades.png").convert("RGB").getpixel((200, 401))
    assert max(abs(a - b) for a, b in zip(kept, orange, strict=True)) < 32
