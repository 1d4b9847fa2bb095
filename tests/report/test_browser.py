"""The page in a browser: it renders at the sizes of a phone, a laptop and paper, and says nothing on the console."""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from magbear_cli.claims.ledger import Finding, JudgedClaim, Listing, Verdict
from magbear_cli.report.writing import write_ledger

SIZES = {"phone": (390, 844), "laptop": (1280, 800)}
Browser = Any  # a driver of selenium, which has no types

VISIBLE_FIGURES = """
return Array.from(document.querySelectorAll('figure.plate svg')).filter(svg => {
  const box = svg.getBoundingClientRect();
  return box.width > 200 && box.height > 80 && svg.querySelectorAll('path, use').length > 5;
}).length;
"""
ROWS = """
return Array.from(document.querySelectorAll('table.cases tbody tr'))
  .filter(row => row.getBoundingClientRect().height > 0).map(row => row.dataset.case);
"""


def _open_browser(*arguments: str, has_scripts: bool = True) -> Browser:
    """A headless Chromium, or a test that is skipped and says why."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if browser is None or driver is None:
        pytest.skip("no browser: apt-get install chromium chromium-driver")
    from selenium.webdriver import Chrome, ChromeOptions, ChromeService

    options = ChromeOptions()
    options.binary_location = browser
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", *arguments):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    if not has_scripts:
        options.add_experimental_option("prefs", {"profile.managed_default_content_settings.javascript": 2})
    return Chrome(options=options, service=ChromeService(driver, log_output=os.devnull))


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One browser for the tests of this file."""
    driver = _open_browser()
    yield driver
    driver.quit()


@pytest.fixture
def look(browser: Browser, mixed_report: Path) -> Callable[[tuple[int, int]], Browser]:
    """The page opened at a size."""

    def open_page(size: tuple[int, int]) -> Browser:
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
        device = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", device)
        browser.get((mixed_report / "index.html").as_uri())
        return browser

    return open_page


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", list(SIZES.values()), ids=list(SIZES))
def test_the_page_renders(look: Callable[..., Browser], size: tuple[int, int], scheme: str) -> None:
    """Every row and every unfolded figure is there, nothing sticks out sideways, and the console is silent."""
    page = look(size)
    page.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    )
    assert page.get_log("browser") == []
    assert len(page.execute_script(ROWS)) == 5
    page.execute_script("document.querySelectorAll('details').forEach(part => { part.open = true; });")
    figures = page.execute_script("return document.querySelectorAll('figure.plate').length")
    assert figures > 8
    assert page.execute_script(VISIBLE_FIGURES) == figures
    assert page.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    assert page.execute_script("return document.querySelectorAll('table.steps tbody tr').length") > 3
    dark = page.execute_script("return getComputedStyle(document.body).backgroundColor") == "rgb(20, 24, 28)"
    assert dark is (scheme == "dark")


def test_the_page_prints(look: Callable[..., Browser]) -> None:
    """On paper folded cases are open and every figure and row is there, whatever was filtered; tools are not."""
    page = look(SIZES["laptop"])
    page.execute_script(
        "const words = document.querySelector('.tools input'); words.value = 'nothing has this';"
        "words.dispatchEvent(new Event('input'));"
    )
    assert page.execute_script(ROWS) == []
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert len(page.execute_script(ROWS)) == 5
    figures = page.execute_script("return document.querySelectorAll('figure.plate').length")
    assert page.execute_script(VISIBLE_FIGURES) == figures
    assert page.execute_script("return document.querySelector('.tools').getBoundingClientRect().height") == 0
    printed = base64.b64decode(page.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    assert printed.startswith(b"%PDF")
    assert len(printed) > 100_000
    assert page.get_log("browser") == []


def test_cases_are_sorted_and_filtered(look: Callable[..., Browser]) -> None:
    """A click on a head sorts by it and another turns it round; words and a status leave the rows that have them."""
    page = look(SIZES["laptop"])
    given = page.execute_script(ROWS)
    head = "document.querySelectorAll('table.cases thead th')[3]"  # the bandwidth limit
    page.execute_script(f"{head}.click()")
    rising = page.execute_script(ROWS)
    assert page.execute_script(f"return {head}.getAttribute('aria-sort')") == "ascending"
    assert rising != given
    assert sorted(rising) == sorted(given)
    assert rising[:2] == [given[3], given[4]]  # 4 000 and 5 000 rad/s
    page.execute_script(f"{head}.click()")
    assert page.execute_script(ROWS)[-2:] == [given[4], given[3]]
    choose = "const box = document.querySelectorAll('.tools select')[{}]; box.value = '{}'; {}"
    change = "box.dispatchEvent(new Event('change'));"
    page.execute_script(choose.format(1, -1, change))
    assert page.execute_script(ROWS) == given
    page.execute_script(choose.format(0, "infeasible", change))
    assert page.execute_script(ROWS) == [given[3]]
    assert page.execute_script("return document.querySelector('.tools output').textContent") == "1 of 5 cases"


def test_a_link_to_a_case_opens_it(look: Callable[..., Browser]) -> None:
    """The name of a case in the table leads to its unfolded section."""
    page = look(SIZES["laptop"])
    page.execute_script("document.querySelectorAll('section > details').forEach(part => { part.open = false; });")
    page.execute_script("document.querySelector('table.cases tbody a').click()")
    target = "document.getElementById(decodeURIComponent(location.hash.slice(1)))"
    assert page.execute_async_script(f"const done = arguments[0]; setTimeout(() => done({target}.open), 100);")


def test_a_value_is_read_off_a_figure(look: Callable[..., Browser]) -> None:
    """The pointer in the middle of the Nyquist panel reads the middle of its axes; outside of the panels nothing."""
    page = look(SIZES["laptop"])
    page.execute_script("document.querySelectorAll('details').forEach(part => { part.open = true; });")
    script = """
    const paper = document.querySelector("figure[id^='nyquist'] .paper");
    const picture = paper.querySelector('svg'), box = picture.getBoundingClientRect();
    const [left, bottom, right, top] = JSON.parse(picture.dataset.panels)[0];
    const x = box.left + arguments[0] * (left + right) / 2 * box.width;
    const y = box.top + (1 - (bottom + top) / 2) * box.height;
    paper.dispatchEvent(new PointerEvent('pointermove', {clientX: x, clientY: y, bubbles: true}));
    const reading = paper.querySelector('.reading');
    return reading.hidden ? null : reading.textContent;
    """
    assert page.execute_script(script, 1) == "real part: -1.10   imaginary part: 0.00"
    assert page.execute_script(script, 0) is None
    shown = page.execute_script("return document.querySelectorAll('.paper .reading').length")
    others = "return document.querySelectorAll('figure.plate:not([id^=poles])').length"  # whose axes are neither
    assert shown == page.execute_script(others)
    assert page.get_log("browser") == []


def test_the_ledger_renders(look: Callable[..., Browser], tmp_path: Path) -> None:
    """The page of the thesis's claims fits a phone too, with a wide table, and with long names of datasets unfolded."""
    listing = Listing(tuple(f"quantity {k}" for k in range(12)), (tuple(["1.234e5"] * 12),))
    path = "sec_3_5_settings/results.h5:case_0001/frequency/complementary_sensitivity_of_the_loop[3.0 kg, 4.5 kg]"
    finding = Finding("0.98", Verdict.CONFIRMED, "it is what is printed", listing)
    claim = JudgedClaim("C01", "section 2", "a claim", "0.98", finding, (path, path))
    written = write_ledger((claim,), None, (), {}, tmp_path)
    page = look(SIZES["phone"])
    page.get(written.as_uri())
    page.execute_script("document.querySelectorAll('details').forEach(part => { part.open = true; });")
    assert page.execute_script("return document.documentElement.scrollWidth <= window.innerWidth")
    assert page.execute_script("return document.querySelector('table.listing').getBoundingClientRect().height") > 20
    assert page.get_log("browser") == []


def test_without_scripts_the_page_is_whole(mixed_report: Path) -> None:
    """With scripts switched off every row is there in the study's order, and no tool that would do nothing."""
    driver = _open_browser(has_scripts=False)
    try:
        driver.get((mixed_report / "index.html").as_uri())
        rows = driver.find_elements("css selector", "table.cases tbody tr")
        assert len(rows) == 5
        assert all(row.is_displayed() for row in rows)
        assert not driver.find_elements("css selector", ".tools")
        assert driver.get_log("browser") == []
    finally:
        driver.quit()
