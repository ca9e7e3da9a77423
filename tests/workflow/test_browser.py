"""What `make ui` and `snakemake --report` show, seen with a real browser. Screenshots stay in results/screenshots."""

import json
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote, urlparse

import mlflow
import numpy as np
import pandas as pd
import pytest
from project_copy import ROOT, SMALL_SWEEP, Project, copy_project

pytestmark = [
    pytest.mark.browser,
    pytest.mark.filterwarnings("ignore::ResourceWarning"),  # of the browser's driver
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

SMALL = {
    "targets": {"datasets": ["case1", "case2"], "scales": [1, 2]},
    "data": {"datasets": {"case1": {"samples": 150}, "case2": {"samples": 150}}},
    "learning": {
        "seeds": 2,
        "recipes": {"rollout": {"epochs": 12, "hidden": 8, "simulated_trials": 2}},
        "sweep": SMALL_SWEEP | {"trials": 5},
    },
}
CONFIG = ("--configfile", "config.yaml", "mine.yaml")
VERDICT = "results/diagnosis/case1/verdict.html"
SCREENSHOTS = ROOT / "results/screenshots"
# Lines of level SEVERE that MLflow writes itself: it asks who is logged in and takes the 404 for "nobody", and a table
# of runs may be left while it is still drawn.
EXPECTED = ("mlflow/users/current", "AG Grid: unable to find bean reference")


class Browser:
    """Chromium without a screen, and what its console said."""

    def __init__(self) -> None:
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for argument in ("headless=new", "no-sandbox", "disable-gpu", "disable-dev-shm-usage", "window-size=1920,1300"):
            options.add_argument(f"--{argument}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))

    def open(self, address: str, *, until: str, name: str) -> str:
        """Text of a page once it matches `until`; a screenshot is kept under `name`."""
        self.driver.get("about:blank")
        self.driver.get(address)
        text = self.wait(until)
        self.keep(name)
        return text

    def wait(self, until: str, seconds: float = 60.0) -> str:
        """Text of the page once it matches `until`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            text = self.driver.execute_script("return document.body ? document.body.innerText : ''")
            if re.search(until, text):
                time.sleep(1.5)  # charts draw themselves
                return self.driver.execute_script("return document.body.innerText")
            time.sleep(0.3)
        self.keep("failed")
        raise AssertionError(f"{until!r} did not appear within {seconds} s; the page says: {text[:2000]}")

    def click(self, text: str) -> None:
        self.driver.find_element("xpath", f"//*[normalize-space(text())='{text}']").click()

    def keep(self, name: str) -> None:
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        self.driver.save_screenshot(str(SCREENSHOTS / f"{name}.png"))

    def script(self, text: str):
        return self.driver.execute_script(f"return {text}")

    def errors(self) -> list[str]:
        lines = [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]
        return [line for line in lines if not any(known in line for known in EXPECTED)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if not Path("/usr/bin/chromium").exists() or not Path("/usr/bin/chromedriver").exists():
        pytest.skip("there is no Chromium here: apt-get install chromium chromium-driver, as `make test-browser` does")
    browser = Browser()
    yield browser
    browser.driver.quit()


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Project:
    """A project with all results of a small configuration, and a sweep."""
    project = copy_project(tmp_path_factory.mktemp("finished"))
    project.lay_over(SMALL)
    done = project.snakemake("--cores", "2", *CONFIG, "--", "all", "sweep")
    assert done.returncode == 0, done.stdout
    return project


@pytest.fixture(scope="module")
def page(finished) -> Iterator[str]:
    """Address that `myowave ui` prints, with the server running."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", "from myowave.cli import app; app()", "ui", "--port", str(port)]
    server = subprocess.Popen(command, cwd=finished.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    address = None
    for line in server.stdout:
        address = address or (re.search(r"http://\S+", line) or [None])[0]
        if "Uvicorn running" in line:
            break
    yield address
    server.terminate()
    server.wait(timeout=30)
    server.stdout.close()


@pytest.fixture(scope="module")
def store(finished) -> mlflow.MlflowClient:
    return mlflow.MlflowClient(tracking_uri=f"sqlite:///{finished.folder}/results/mlflow.db")


@pytest.fixture(scope="module")
def summary(finished) -> pd.DataFrame:
    return pd.read_csv(finished.folder / "results/summary.csv")


def shown(value: float, text: str, digits: float = 1e-6) -> bool:
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+(?:e-?\d+)?", text)]
    return any(number == pytest.approx(value, rel=digits) for number in numbers)


def test_the_first_page_is_the_table_of_runs_with_scores_and_recipe(browser, page, summary):
    text = browser.open(page, until=r"case2: adequate", name="table")
    assert all(column in text for column in ("test_r2", "test_rmse_deg", "recipe"))
    for _, rows in summary.groupby("dataset"):
        medians = rows.groupby(["model", "recipe", "scales"])["test_r2"].median()
        assert any(shown(value, text) for value in medians), "of the network that is best on validation trials"
    browser.driver.find_element("xpath", "//a[contains(., 'case1: adequate')]").click()
    browser.wait("Description")
    browser.keep("run")
    assert browser.errors() == []


def test_verdict_tables_and_pictures_are_on_the_page_of_the_dataset(browser, page, store, summary):
    experiment = store.get_experiment_by_name("myowave").experiment_id
    (run,) = store.search_runs([experiment], "params.dataset = 'case1' and params.verdict != ''")
    base = f"{page.split('#')[0]}#/experiments/{experiment}/runs/{run.info.run_id}"
    network = summary[(summary["dataset"] == "case1") & (summary["scales"] == 2)]
    table = f"{base}/artifacts/base/rollout/2-scale/evaluation.csv"
    text = browser.open(table, until="test_r2", name="artifact_table")
    assert shown(network["test_r2"].iloc[0], text, 1e-3)
    browser.open(f"{base}/artifacts/figures/trials.png", until="trials.png", name="artifact_picture")
    assert max(browser.script("[...document.images].map(i => i.naturalWidth)")) > 500, "the figure is not shown"
    browser.open(f"{base}/artifacts/verdict.html", until="verdict.html", name="artifact_verdict")
    assert browser.driver.find_elements("tag name", "iframe")
    assert browser.errors() == []


def test_the_report_is_one_page_that_works_without_a_network(browser, finished):
    done = finished.snakemake(*CONFIG, "--report", "report.html", "--", "all", "sweep")
    assert done.returncode == 0, done.stdout
    report = finished.folder / "report.html"
    text = browser.open(report.as_uri(), until="(?i)results", name="report")
    assert 0 < text.find("1 data") < text.find("2 learning")
    browser.click("2 learning")
    text = browser.wait("metrics")
    browser.keep("report_learning")
    assert all(label in text.lower() for label in ("dataset", "model", "recipe", "figure"))
    browser.driver.get("about:blank")
    browser.open(report.as_uri(), until="(?i)results", name="report")
    browser.click("3 diagnosis")
    browser.wait("case1")
    browser.click("case1")
    text = browser.wait("00 verdict")
    browser.keep("report_diagnosis")
    places = [text.find(name) for name in ("00 verdict", "01 glance", "05 ranking", "06 ladder")]
    assert places == sorted(places) and places[0] > 0, text
    external = browser.script(
        "performance.getEntriesByType('resource').map(e => e.name).filter(n => n.startsWith('http'))"
    )
    assert external == []
    browser.driver.find_element("xpath", "//tr[contains(., '00 verdict')]//a").click()
    time.sleep(2.0)
    frame = browser.driver.find_element("tag name", "iframe")
    browser.driver.switch_to.frame(frame)
    drawn = browser.script("document.querySelectorAll('.uplot').length")
    browser.driver.switch_to.default_content()
    assert drawn == 2, "the verdict opens inside the report and draws the motion and its error"
    assert browser.errors() == []


def test_the_motion_can_be_zoomed_and_each_model_switched_off(browser, finished):
    browser.open((finished.folder / VERDICT).as_uri(), until="whole trial", name="verdict")
    scale = "document.getElementById('motion').plots.map(p => [p.scales.x.min, p.scales.x.max])"
    (whole, same), shown = (
        browser.script(scale),
        "document.getElementById('motion').plots.map(p => p.series.at(-1).show)",
    )
    browser.click("zoom in")
    (near, also), middle = browser.script(scale), sum(whole) / 2
    assert whole == same and near == also, "the error is shown over the same time"
    assert whole[0] < near[0] < middle < near[1] < whole[1]
    browser.click("whole trial")
    assert browser.script(scale) == [whole, whole]
    tick = browser.driver.find_elements("css selector", "#motion input[type=checkbox]")[-1]
    assert browser.script(shown) == [True, True]
    tick.click()
    assert browser.script(shown) == [False, False]
    assert browser.errors() == []


def test_the_index_shows_every_dataset_and_its_links_lead_somewhere_and_back(browser, finished):
    browser.open((finished.folder / "results/index.html").as_uri(), until="what to do next", name="index")
    widths = "[...document.querySelectorAll('#datasets img')].map(e => e.naturalWidth)"
    assert len(browser.script(widths)) == 2 and min(browser.script(widths)) > 300
    for page in ("results/index.html", VERDICT):
        browser.open((finished.folder / page).as_uri(), until="myowave", name="links")
        links = [link for link in browser.script("[...document.links].map(a => a.href)") if link.startswith("file:")]
        assert [link for link in links if not Path(unquote(urlparse(link).path)).exists()] == []
        assert len(links) > 5
    assert any(link.endswith("results/index.html") for link in links), "there is a way back"
    assert browser.errors() == []


@pytest.mark.parametrize("page", ["results/index.html", VERDICT])
@pytest.mark.parametrize("width", [1280, 920, 768, 390])
def test_tables_are_whole_on_a_screen_and_on_a_phone(page, width, browser, finished):
    screen = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    try:
        browser.open((finished.folder / page).as_uri(), until="held-out", name=f"{Path(page).stem}_{width}")
        browser.script("document.querySelectorAll('details').forEach(part => { part.open = true; })")
        wide = "document.documentElement.clientWidth"
        ends = browser.script("[...document.querySelectorAll('table')].map(t => t.getBoundingClientRect().right)")
        assert ends and max(ends) <= browser.script(wide)
        assert browser.script(f"document.documentElement.scrollWidth - {wide}") <= 0
    finally:
        browser.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_model_that_runs_away_hides_no_motion(browser, finished, tmp_path):
    before, data, after = re.split(
        '(?s)(?<=id="motion-data">)(.*?)(?=</script>)', (finished.folder / VERDICT).read_text("utf-8"), maxsplit=1
    )
    told = json.loads(data)
    for trial in told["trials"]:
        trial["predicted"][0] = [9_000_000 - angle for angle in trial["predicted"][0]]
    (tmp_path / "verdict.html").write_text(before + json.dumps(told) + after, "utf-8")
    browser.open((tmp_path / "verdict.html").as_uri(), until="whole trial", name="verdict_far")
    scale = "document.getElementById('motion').plots.map(p => [p.scales.y.min, p.scales.y.max])"
    (low, high), (under, over) = browser.script(scale)
    measured = np.array(next(trial["measured"] for trial in told["trials"] if trial["held_out"])) / 1000
    least, most = measured.min(), measured.max()
    assert low <= least and most <= high and high - low < 4 * (most - least)
    assert under < 0 < over and over - under < 3 * (most - least)
    assert browser.errors() == []
