"""What a comparison leaves, and that nothing emulated passes as measured."""

import io
import json
import re
from dataclasses import replace

from flexlab.cli.compare import save
from flexlab.comparison import pages, report, table
from flexlab.comparison.measures import (
    compare,
)
from flexura.io import EMULATED, Run, called


def text_chunks(png):
    from PIL import Image

    return Image.open(io.BytesIO(png)).text


def terminal(c):
    from rich.console import Console

    console = Console(width=120, file=io.StringIO())
    console.print(table.table(c))
    return console.file.getvalue()


def test_what_is_emulated_says_so_everywhere(compared, page, document):
    words = EMULATED.removeprefix("emulated: ")
    assert "experiment (emulated)" in terminal(compared) and words[:40] in terminal(compared)
    assert (
        table.numbers(compared)["emulated"] is True
        and "(emulated)" in table.numbers(compared)["title"]
    )
    head = page[: page.index("<table")]
    assert '<p class="emulated">' in head and words in head and "(emulated)" in head
    figures = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(figures) == 3 and all("(emulated)" in figure for figure in figures)
    assert page.count("<figcaption>Fig. ") == 3
    assert all(
        "(emulated)" in caption for caption in re.findall(r"<figcaption>(.*?)</figcaption>", page)
    )
    said = text_chunks(report.png(compared))
    assert "(emulated)" in said["Title"] and said["Description"] == EMULATED
    assert (
        rb"\(emulated\)" in document and words.encode() in document
    )  # its properties; its text is compressed


def test_a_measurement_does_not_say_emulated(compared):
    meta = compared.experiment.meta | {"emulated": False, "label": "experiment"}
    simulated = replace(
        compared.simulation, meta=compared.simulation.meta | {"simulates": "forward experiment"}
    )
    real = compare(simulated, replace(compared.experiment, meta=meta))
    assert "emulated" not in terminal(real) and not table.numbers(real)["emulated"]
    own = report.html(real)
    assert "(emulated)" not in own and 'class="emulated"' not in own
    assert "emulated" not in str(text_chunks(report.png(real)))


def test_the_page_stands_alone(page):
    assert (
        not re.findall(r'(?:src|href)="(?!#)', page.replace('xlink:href="#', ""))
        and "<script" not in page
    )
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    used = set(re.findall(r'(?:href="#|url\(#)([^")]+)', page))
    assert used <= set(ids)


def test_the_same_runs_give_the_same_report(compared, page, document):
    assert report.html(compared) == page and pages.pdf(compared) == document


def test_all_tables_have_the_same_cells(compared, page):
    rows = table.rows(compared)
    assert [row[0] for row in rows[:3]] == [
        "joint variable 1",
        "joint variable 2",
        "tip displacement of link 2",
    ]
    assert [row[-1] for row in rows[:3]] == ["4.35 %", "7.5 %", "7.5 %"]
    for row in rows:
        assert "".join(f"<td>{cell}</td>" for cell in row) in page


def test_the_sheets_have_every_row_and_no_text_lies_on_another(compared):
    sheets = pages.drawn(compared)
    found = []
    for sheet in sheets:
        sheet.draw_without_rendering()
        texts = [text for text in sheet.texts if text.get_text()]
        found += [text.get_text() for text in texts]
        boxes = [text.get_window_extent() for text in texts]
        boxes += [axes.get_tightbbox() for axes in sheet.axes]
        for k, box in enumerate(boxes):
            assert sheet.bbox.x0 < box.x0 and box.x1 < sheet.bbox.x1
            assert sheet.bbox.y0 < box.y0 and box.y1 < sheet.bbox.y1
            for other in boxes[:k]:
                across = min(box.x1, other.x1) - max(box.x0, other.x0)
                up = min(box.y1, other.y1) - max(box.y0, other.y0)
                assert across <= 1 or up <= 1
    written = " ".join(found).replace(" ", "")
    for row in [*table.rows(compared), *report.about(compared)]:
        for cell in row:
            assert cell.replace(" ", "") in written
    assert sum(len(sheet.axes) for sheet in sheets) == 2 * len(compared.differences)


def test_the_folder_has_it_all(compared, tmp_path):
    paths = save(compared, tmp_path, simulated=True)
    assert {p.name for p in paths} == {
        "run.parquet",
        "comparison.json",
        "report.html",
        "report.pdf",
        "comparison.png",
        "review.rrd",
    }
    stored = json.loads((tmp_path / "comparison.json").read_text())
    assert stored == json.loads(json.dumps(table.numbers(compared)))
    assert [row["published_percent"] for row in stored["deviations"]] == [4.35, 7.5, 7.5]
    again = Run.read(tmp_path / "simulation")
    assert compare(again, compared.experiment).differences == compared.differences
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_the_review_shows_the_dissertations_figures(compared, tmp_path):
    from flexlab.review.layout import _figures
    from flexlab.review.writer import _part

    shown, scene = _part("", [compared.simulation, compared.experiment])
    assert scene.measured
    names = [
        column.contents[0].name
        if not hasattr(column.contents[0], "active_tab")
        else column.contents[0].contents[0].name
        for column in _figures(scene)
    ]
    assert names == ["joint variable 1", "joint variable 2", "tip flexural displacement, link 2"]
    below = [column.contents[1].name for column in _figures(scene)]
    assert below == [f"deviation of {name}" for name in names]
    assert all("(emulated)" in s.label for s in scene.signals.values() if "experiment" in s.label)
    assert called(compared.experiment) == shown[1].label == "experiment (emulated)"


def test_the_review_file_says_emulated(compared, tmp_path):
    from rerun.chunk import RrdReader

    from flexlab.review import write_review

    path = write_review(tmp_path / "r.rrd", [compared.simulation, compared.experiment])
    roots, pages = set(), []
    for chunk in RrdReader(path).stream():
        roots.add(chunk.entity_path.split("/")[1])
        batch = chunk.to_record_batch()
        if "TextDocument:text" in batch.schema.names:
            pages += batch.column("TextDocument:text").to_pylist()
    assert {"simulation", "experiment", "deviation"} <= roots
    (page,) = [p[0] for p in pages]
    assert (
        "experiment (emulated): emulated." in page
        and "| joint variable 1 |" in page
        and "7.5 %" in page
    )
