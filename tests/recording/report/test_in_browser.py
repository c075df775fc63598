"""A report opened from disk in headless Chromium: no error, no request, images at the mouse, one zoom for all plots."""

from __future__ import annotations

import json

import pytest

from lsds.session.recording.report.page import write_report
from tests.recording.report.browser import MISSING, chromium

pytest.importorskip("plotly", reason="reports need the extra report")
pytestmark = pytest.mark.skipif(bool(MISSING), reason=MISSING)

PLACE = """(() => {
  const plot = document.getElementById("plot"), box = plot.getBoundingClientRect(), full = plot._fullLayout;
  const place = (axis, x, y) => [box.left + full.xaxis._offset + x * full.xaxis._length,
                                 box.top + axis._offset + y * axis._length];
  return [full.yaxis, full.yaxis2, full.yaxis3, full.yaxis4].map((a) => [place(a, 0.3, 0.5), place(a, 0.6, 0.5)]);
})()"""
RANGE = "document.getElementById('plot').layout.xaxis.range.slice()"
OVERLAPS = """(() => {
  const found = [...document.querySelectorAll(SELECTOR)].filter((e) => e.textContent.trim() || e.tagName === "A");
  const boxes = found.map((e) => e.getBoundingClientRect()).filter((b) => b.width > 0);
  const clash = (a, b) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1;
  return boxes.flatMap((a, i) => boxes.slice(i + 1).filter((b) => clash(a, b))).length + 1000 * (boxes.length === 0);
})()""".replace(
    "SELECTOR",
    "'#plot .annotation-text, #plot .legendtext, #plot .xtick text, #plot .modebar-btn, #plot .xtitle'",
)


@pytest.fixture(scope="module")
def browser():
    with chromium() as window:
        yield window


@pytest.fixture
def opened(browser, recorded, tmp_path):
    path, _ = recorded
    out = tmp_path / "run.html"
    write_report(path, out)
    browser.log("browser"), browser.log("performance")
    browser.open(out)
    return browser


def test_the_page_opens_without_an_error_and_requests_nothing(opened):
    assert opened.run("document.querySelectorAll('#plot .main-svg').length") > 0
    opened.mouse(*(place for row in opened.run(PLACE) for place in row))
    assert opened.log("browser") == []
    events = [json.loads(each["message"])["message"] for each in opened.log("performance")]
    requests = [e["params"]["request"]["url"] for e in events if e["method"] == "Network.requestWillBeSent"]
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
    assert sum(url.startswith("file:") for url in requests) <= 1


def test_the_image_follows_the_mouse_in_every_plot(opened):
    for early, late in opened.run(PLACE):
        seen = []
        for place in (early, late):
            before = opened.run("document.getElementById('now').textContent")
            opened.mouse(place)
            opened.wait(f"document.getElementById('now').textContent !== {json.dumps(before)}")
            seen.append(opened.run("document.querySelector('img[data-finger]').src"))
        assert seen[0].startswith("data:image/jpeg;base64,")
        assert seen[0] != seen[1]
    assert opened.run("document.querySelector('img[data-finger]').naturalWidth") == 320
    at_s = float(opened.run("document.getElementById('now').textContent").split()[2])
    begin, end = opened.run(RANGE)
    assert at_s == pytest.approx(begin + 0.6 * (end - begin), abs=0.05)


def test_zooming_one_plot_zooms_all_and_moves_the_names_of_the_stages(opened):
    begin, end = opened.run(RANGE)
    (x0, y0), (x1, _) = opened.run(PLACE)[2]
    opened.mouse((x0, y0), "down", (x0 + 20, y0), (x1, y0), "up")
    opened.wait(f"{RANGE}[0] > {begin} + 0.1")
    low, high = opened.run(RANGE)
    assert low == pytest.approx(begin + 0.3 * (end - begin), abs=0.1)
    assert high == pytest.approx(begin + 0.6 * (end - begin), abs=0.1)
    axes = opened.run("document.getElementById('plot')._fullLayout._subplots.cartesian")
    assert axes == ["xy", "xy2", "xy3", "xy4"]
    opened.wait(f"document.getElementById('plot').layout.annotations.every((a) => a.x >= {low} && a.x < {high})")
    assert opened.run(OVERLAPS) == 0


def test_no_label_overlaps_another(opened, tmp_path):
    assert opened.run(OVERLAPS) == 0


def test_an_event_shows_its_time(opened):
    opened.run("document.querySelector('#events tr:nth-child(4)').click()")
    expected = opened.run("document.querySelector('#events tr:nth-child(4)').dataset.s")
    assert opened.run("document.getElementById('now').textContent").startswith(f"t = {float(expected):.3f} s")
