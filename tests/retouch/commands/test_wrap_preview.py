"""`retouch wrap --preview`: a page before the wait, with what will come out; bad input in one line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

import retouch
from relief.heightmap import save_heights_exr
from retouch.commands.main import BAD_INPUT, main
from retouch.verbs.objects import wrapping

HOSTILE = "<img src=x onerror=alert(1)>"


@pytest.fixture(autouse=True)
def _files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    at = 2.0 * np.pi * np.arange(20) / 20
    save_heights_exr("waves.exr", 0.1 * (2.0 + np.sin(at)[:, None] + np.sin(at)[None, :]), 6.0)
    trimesh.creation.box((16.0, 14.0, 6.0)).export("box.stl")
    monkeypatch.setattr(wrapping, "SHOWN_FACES", 4000)


@pytest.mark.slow
def test_the_page_alone_is_written_and_told(capsys):
    assert main(["wrap", "waves.exr", "box.stl", "--mask", "z>0", "--preview", "page.html"]) == 0
    assert sorted(path.name for path in Path().iterdir()) == ["box.stl", "page.html", "waves.exr"]
    line = capsys.readouterr().out
    assert re.search(
        r"page.html: 16[.]\d+ x 14[.]\d+ x 6.4 mm on [\d,]+ triangles; retouch wrap will make about", line
    )
    text = Path("page.html").read_text(encoding="utf-8")
    assert "waves on box" in text and not re.search(r"https?://", text)
    for told in ("Longest side", "Triangles", "File", "Time", 'data-layer="Texture"', 'data-split="50"'):
        assert told in text


@pytest.mark.slow
def test_what_is_told_is_what_will_come_out(capsys):
    # Faces of a box are planes, so that the triangles of both are alike.
    options = ["waves.exr", "box.stl", "--mask", "angle<5", "--edge-mm", "0.4"]
    assert main(["wrap", *options, "-o", "out.stl", "--preview", "page.html", "--json"]) == 0
    wrapped = json.loads(capsys.readouterr().out)
    assert wrapped["preview"] == "page.html" and wrapped["file"] == "out.stl"
    assert main(["wrap", *options, "--preview", "page.html", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["size_mm"] == pytest.approx(wrapped["size_mm"], abs=0.05)
    assert told["area_mm2"] == pytest.approx(wrapped["area_mm2"], rel=0.1)
    assert told["edge_mm"] == 0.4 < told["shown_edge_mm"]
    assert 0.5 < told["faces"] / wrapped["faces"] < 2.0
    assert told["seconds"] > 0.0 and told["bytes"] > 10 * told["faces"]


@pytest.mark.slow
def test_names_are_shown_as_they_are():
    heights = retouch.load_heights("waves.exr")
    Path("box.stl").rename(f"{HOSTILE}.stl")
    made = retouch.preview_wrap(heights, f"{HOSTILE}.stl", "page.html", size_mm=6.0)
    text = made.file.read_text(encoding="utf-8")
    assert made.preview.title == f"heights on {HOSTILE}" and HOSTILE not in text
    assert "heights on &lt;img src=x" in text


@pytest.mark.slow
def test_seams_are_shown_where_patches_do_not_fit():
    trimesh.creation.icosphere(3, 7.0).export("ball.stl")
    shown = retouch.preview_wrap("waves.exr", "ball.stl", "page.html").preview.shown
    assert 0.0 < shown.seams.mean() < 0.5
    assert shown.blended == pytest.approx(shown.seams[shown.textured > 0.0].mean())
    assert 'data-layer="Seams"' in Path("page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        ((), "-o: missing; or --preview"),
        (("--preview", "page.3mf"), "page.3mf: --preview: suffix '.3mf' is not .html"),
        (("--preview", "none/page.html"), "--preview: there is no folder none"),
        (("--preview", "page.html", "--mask", "up"), "is no mask"),
        (("--preview", "page.html", "--mask", "z>500"), "leaves nothing of the surface"),
        (("--preview", "page.html", "--faces", "10"), "--faces: '10' is not a whole number from 1000"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys, argv, says):
    assert main(["wrap", "waves.exr", "box.stl", *argv]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("retouch:") == 1 and says in line
    assert not Path("page.html").exists()
