"""The verdict as files: verdict.json, the tables, the pictures and the page that tells it without the network."""

import json
import re
import shlex
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from myowave.diagnosis.comparison.compare import compare_models
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.report.cells import accuracy_cells, parameter_cells, ranking_cells
from myowave.diagnosis.report.contents import COMPARISON_NAMES, FIGURE_NAMES, TABLE_NAMES
from myowave.diagnosis.report.facts import verdict_facts
from myowave.diagnosis.report.figures import draw_diagnosis, draw_ranking
from myowave.diagnosis.report.ladder import join_ladder, join_parameters, shown_network
from myowave.diagnosis.report.motion import beside
from myowave.diagnosis.report.numbers import estimate
from myowave.diagnosis.report.page import Story, write_page
from myowave.diagnosis.report.tables import TABLES, draft_source, ladder_table, predictions_table, ranking_table
from myowave.diagnosis.report.tell import adding_command, says_little, tell
from myowave.diagnosis.scoring import add_truth
from myowave.diagnosis.search.diagnose import diagnose
from myowave.diagnosis.search.next_trial import MENU
from myowave.diagnosis.search.where import missing_torque
from myowave.identification.output_error import fit_from
from myowave.identification.prediction import BEGINNING_S
from myowave.physics.model import parse_model
from myowave.plotting import save
from myowave.settings import DiagnosisSettings

HIDDEN = {"joint_damping": {"c": 0.6}}
MOST_BYTES = 1_500_000  # as a data URL, a third longer, Chromium shows no page over 2 MB: `snakemake --report` needs it
CANDIDATES = ("joint_damping", "joint_stiffness", "hand_load", "gravity_tilt")


@pytest.fixture(scope="module")
def diagnosis(make_trials, base, effects, identify):
    candidates = [effects[name] for name in CANDIDATES]
    return diagnose(make_trials(HIDDEN), base, candidates, identify, DiagnosisSettings(starts=2))


@pytest.fixture(scope="module")
def truth(base):
    return {"effects": list(HIDDEN), "parameters": base.defaults | {"joint_damping.c": 0.6}}


@pytest.fixture(scope="module")
def verdict(diagnosis, truth, comparison):
    """As it comes back from the file."""
    summary = verdict_facts(diagnosis)
    command = adding_command(summary, recipes=["rollout"])
    whole = {**add_truth(summary, truth), **summarize(**comparison), "command": command}
    return json.loads(json.dumps(whole, allow_nan=False))


@pytest.fixture(scope="module")
def tables(diagnosis):
    return {name: table(diagnosis) for name, table in TABLES.items()}


@pytest.fixture(scope="module")
def comparison(make_trials, base, effects, tables):
    return compare_models(
        make_trials(HIDDEN), lambda name: parse_model(name, base, effects), tables["parameters"], tables["errors"]
    )


@pytest.fixture(scope="module")
def network():
    """Evaluation of a network with a model that the diagnosis did not try, two seeds."""
    model = "base+joint_damping+fatigue"
    return pd.DataFrame(
        {
            "dataset": "x",
            "model": model,
            "recipe": "rollout",
            "scales": 1,
            "seed": [0, 1],
            "test_mse": [1e-4, 3e-4],
            "test_rmse_deg": [0.5, 1.0],
            "test_r2": [0.99, 0.97],
            "f0_Bi": [310.0, 330.0],
            "f0_Bi_se": [4.0, 5.0],
            "f0_Bi_error_pct": [10 / 3, 10.0],
        }
    )


def motion_of_network(diagnosis):
    """Two seeds, 1 deg above and below the measured angle, at every second sample."""
    motion = predictions_table(diagnosis).query("model == 'base'").iloc[::2]
    seeds = [motion.assign(seed=seed, predicted_rad=motion["angle_rad"] + np.radians(2 * seed - 1)) for seed in (0, 1)]
    return pd.concat(seeds)


@pytest.fixture(scope="module")
def story(diagnosis, verdict, tables, comparison, network, tmp_path_factory):
    ladder = join_ladder(tables["ladder"], [network])
    parameters = join_parameters(verdict, [network])
    folder = tmp_path_factory.mktemp("pictures")
    predictions = beside(predictions_table(diagnosis), "network", motion_of_network(diagnosis))
    figures = draw_diagnosis(tables | comparison | {"ladder": ladder}, predictions, verdict)
    for name, figure in figures.items():
        save(figure, folder / f"{name}.png")
    images = {name: folder / f"{name}.png" for name in figures}
    return Story(
        verdict=verdict,
        ladder=ladder,
        parameters=parameters,
        ranking=tables["ranking"],
        predictions=predictions,
        images=images,
        draft=draft_source(diagnosis),
    )


def test_verdict_json_says_what_was_found_and_how_well(verdict):
    assert verdict["verdict"] in ("effect", "class") and verdict["effects"] == ["joint_damping"]
    assert verdict["hidden"] == ["joint_damping"] and verdict["hit"]
    assert set(verdict["rmse_deg"]) == set(verdict["parameters"]) == {"base", "base+joint_damping"}
    for errors in verdict["rmse_deg"].values():
        assert set(errors) == {"train", "heldout", "fitted", "noise"}
    for values in verdict["parameters"].values():
        assert all(
            {"value", "se", "unit", "low", "high", "true", "error_pct"} < set(entry) for entry in values.values()
        )
    found = verdict["parameters"]["base+joint_damping"]["joint_damping.c"]
    assert found["error_pct"] == pytest.approx(100 * (found["value"] / 0.6 - 1))


def test_models_are_compared_as_they_were_fitted(make_trials, base, effects, diagnosis, tables, comparison):
    """Estimates are means over causes, and no motion of one model."""
    parameters = tables["parameters"]
    for rung in diagnosis.rungs:
        told = parameters[parameters["model"] == rung.name]
        assert dict(zip(told["parameter"], told["fitted"], strict=True)) == rung.fit.parameters
    other = parameters.assign(value=np.nan)
    again = compare_models(make_trials(HIDDEN), lambda name: parse_model(name, base, effects), other, tables["errors"])
    for name, table in comparison.items():
        pd.testing.assert_frame_equal(again[name], table)


def test_every_table_and_picture_has_the_name_that_the_workflow_knows(tables, comparison, story):
    assert set(tables) == set(TABLE_NAMES) and set(story.images) == set(FIGURE_NAMES)
    assert set(comparison) == set(COMPARISON_NAMES)


def test_the_comparisons_agree_that_damping_was_missing(comparison, tables):
    r2 = comparison["torque"].query("held_out").set_index("model")["r2"]
    errors = comparison["horizons"].query("held_out").pivot(index="horizon_s", columns="predictor", values="rmse_deg")
    assert r2["base+joint_damping"] > r2["base"] > r2["posture and speed"]
    assert (errors["base+joint_damping"] < errors["base"]).loc[2.0:].all(), errors
    whole = tables["errors"].query("role == 'test'").set_index("model")["rmse_deg"]
    assert errors.loc[np.inf, ["base", "base+joint_damping"]].to_dict() == pytest.approx(whole.to_dict())


def test_the_command_trains_every_recipe_with_the_settings_of_the_run(verdict, facts):
    settings = ["config.yaml", "my settings.yaml"]
    command = adding_command(facts(), recipes=["rollout", "paper"], config_files=settings)
    calls = [shlex.split(call) for call in command.split(" && ")]
    assert len(calls) == 2 and all(call[:3] == ["snakemake", "--cores", "2"] for call in calls)
    assert all(call[-3:] == ["--configfile", *settings] for call in calls), "the option takes all that follows it"
    trained, shown = (call[3:-3] for call in calls)
    assert [path.split("/")[2:5] for path in trained] == [
        ["elbow", "base+joint_damping", recipe] for recipe in ("rollout", "paper")
    ]
    assert shown == ["results/diagnosis/elbow/verdict.html"]
    assert "--configfile" not in verdict["command"], "none was given"


def test_without_a_truth_no_error_is_claimed(diagnosis):
    measured = add_truth(verdict_facts(diagnosis), None)
    assert measured["hidden"] is None and measured["hit"] is None
    assert all(e["error_pct"] is None for values in measured["parameters"].values() for e in values.values())


def test_pieces_too_short_for_a_window_lack_no_torque_that_one_could_tell(diagnosis, verdict):
    """Of samples so far apart that half a second has a few, or of pieces cut as short."""
    first = diagnosis.rungs[0].fit
    missing = missing_torque(fit_from(first.model, first.record.cut(0.2), first.free, first.values[None]))
    assert missing.points.empty
    facts = verdict_facts(replace(diagnosis, rungs=tuple(replace(r, missing=missing) for r in diagnosis.rungs)))
    json.dumps(facts, allow_nan=False)
    assert set(facts["missing_torque_Nm"].values()) == {None}
    assert "too short to tell which torque the muscle model lacks" in tell({**verdict, **facts})["missing"]


def test_the_ladder_holds_the_network_beside_the_physics(story, tables):
    ladder = story.ladder
    assert list(ladder["effects"]) == sorted(ladder["effects"]), "models with few effects come first"
    row = ladder[ladder["source"] == "network, rollout, 1-scale"].iloc[0]
    assert row["heldout_rmse_deg"] == 0.75, "the median of the seeds' errors, as in MLflow"
    assert (ladder["source"] == "physics").sum() == len(tables["ladder"])
    spread = story.parameters.query("parameter == 'f0_Bi' and source != 'physics'").iloc[0]
    assert (spread["value"], spread["scatter"], spread["unit"]) == (320.0, 10.0, "N")
    assert spread["se"] == 4.5, "that of one estimate: all seeds see the same trials"


def test_a_predictor_without_physics_is_told_and_is_never_the_network_that_is_shown(tables, network, story):
    plain = [network.assign(recipe=name, model="base", test_rmse_deg=e) for name, e in (("cnn", 0.26), ("mine", 6.0))]
    plain.append(plain[1].assign(recipe="hold", test_r2=-1.1))
    ladder = join_ladder(tables["ladder"], [network], plain)
    assert shown_network(ladder, "base")["source"] == "network, rollout, 1-scale"
    assert shown_network(join_ladder(tables["ladder"], [], plain), "base") is None
    page = write_page(replace(story, ladder=ladder))
    assert "The best predictor without physics, causal convolution, misses by 0.26 deg." in page
    assert "<span>without physics: hold the first angle</span>" in page, "no seed of it can fail"
    assert "<span>without physics: mine</span>" in page, "one of the user's own goes by its name"


def test_the_whole_catalogue_is_ranked_at_every_model(tables, verdict, story):
    ranking = tables["ranking"]
    assert set(ranking[ranking["model"] == "base"]["effect"]) == set(CANDIDATES)
    assert set(ranking[ranking["model"] == "base+joint_damping"]["effect"]) == set(CANDIDATES) - {"joint_damping"}
    assert set(ranking[ranking["effect"] == "hand_load"]["status"]) == {"absorbed"}, "an exact alias is said to be one"
    base = ranking[ranking["model"] == "base"]
    error = "error of the fit [deg]"
    assert error in ranking_cells(base, verdict) and error not in ranking_cells(base, {**verdict, "follows": False})
    cells = ranking_cells(base, verdict).set_index("effect")
    assert cells.loc["hand_load", "smallest detectable"] == "", "none of any size can be seen"
    damping = cells.loc["joint_damping"]
    own = parameter_cells(story.parameters.query("model == 'base+joint_damping' and source == 'physics'"))
    value = own.loc[own["parameter"].str.contains("joint_damping.c", regex=False), "value ± SE"].item()
    assert damping["estimate"] == f"c = {value} N m s/rad", "as in the table of parameters"
    for cell in ("estimate", "smallest detectable"):
        assert damping[cell].endswith(" N m s/rad"), "no value stands without its unit"


class Links(HTMLParser):
    """What a browser would load or go to."""

    def __init__(self):
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.found += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "action", "data")]


def test_the_page_needs_nothing_else(story):
    page = write_page(story)
    links = Links()
    links.feed(page)
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in links.found)
    addresses = set(re.findall(r"https?://[^\s'\"]+", page))
    assert addresses == {"https://github.com/leeoniya/uPlot"}, "but for the name of the library, in its licence line"
    assert not re.search(r"@import|url\(|fetch\(|XMLHttpRequest|<script[^>]+src", page)
    assert "default-src 'none'" in page, "the browser is told to load nothing"
    assert len([link for link in links.found if link.startswith("data:")]) == len(story.images)


def test_the_page_tells_the_verdict_and_the_command_in_order(story):
    page = write_page(story)
    places = [page.index(f'<h2 id="{step}"') for step in ("compare", "where", "which", "add", "watch")]
    assert places == sorted(places)
    top = page[page.index("<h1>") : page.index("</h1>")]
    assert "Missing: damping of the joint" in top, "the verdict is the headline"
    command = page[page.index("<pre>") : page.index("</pre>")]
    assert "results/diagnosis/" in command and "base+joint_damping/rollout" in command
    assert "absorb" in page and "hand_load" in page
    where = page[places[1] : places[2]]
    assert "posture and speed alone" in where and "s after a measured state" in where


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            {"verdict": "unknown", "effects": [], "formula": "+1.2 q", "nearest": ["joint_damping"]},
            "physics.effect_files",
        ),
        ({"verdict": "unknown", "effects": [], "formula": "0"}, "No short formula"),
        ({"verdict": "unknown", "effects": [], "formula": "+1.2 q"}, "q in rad"),
        ({"verdict": "adequate", "effects": []}, "nothing to add"),
        (
            {"verdict": "undecidable", "effects": [], "model": "base", "outside_usual_range": {"f0_Bi": ["hand_load"]}},
            "easure maximum isometric force of the biceps on the subject",
        ),
        ({"verdict": "undecidable", "effects": [], "model": "base"}, "Record more trials like these; run again."),
        (
            {"verdict": "undecidable", "effects": [], "outside_usual_range": {"f0_Bi": ["x"]}},
            "But maximum isometric force of the biceps is unusual, or there is x.",
        ),
        ({"verdict": "partial", "formula": "+1.2 q"}, "more is left, which has no name"),
        (
            {"verdict": "partial", "rest": "muscle curves or paths of another shape"},
            "which goes with muscle curves or paths of another shape",
        ),
        (
            {"next_trial": {"question": "a or b", "trial": "passive swing", "separation": 40.0, "now": 2.0}},
            "Record one more trial: let all muscles go",
        ),
    ],
)
def test_the_page_says_what_to_do_whatever_the_verdict(story, changes, expected):
    changed = replace(story, verdict={**story.verdict, **changes})
    assert expected in write_page(changed)


def test_an_empty_catalogue_has_a_table_and_a_picture_without_rows(diagnosis, tables, story):
    ladder = replace(diagnosis.verdict.ladder, rankings=([],) * len(diagnosis.verdict.ladder.fits))
    table = ranking_table(replace(diagnosis, verdict=replace(diagnosis.verdict, ladder=ladder)))
    assert list(table) == list(tables["ranking"]) and not len(table)
    assert draw_ranking(table, {}).axes and write_page(replace(story, ranking=table))


def test_no_effect_is_drafted_for_what_goes_with_curves(story):
    changes = {"verdict": "unknown", "effects": [], "nearest": []}
    rest = {"formula": "0", "rest": "muscle curves or paths of another shape"}
    nameless, named = (
        write_page(replace(story, verdict={**story.verdict, **changes, **more}))
        for more in ({"formula": "+1.2 q"}, rest)
    )
    assert "Look at the draft below" in nameless and "q in rad" in nameless
    assert "draft below" not in named and "No short formula" not in named and "physics.effect_files" not in named
    assert "It goes with muscle curves or paths of another shape" in named and "physics.curves" in named


def test_noise_of_the_emg_is_named_in_words_and_there_is_no_model_to_add(story):
    assert story.verdict["titles"]["emg_noise"] == "noise of the recorded EMG"
    noisy = {"verdict": "effect", "effects": ["emg_noise"], "model": "base", "emg_noise": 0.02, "emg_motion_deg": 1.2}
    page = write_page(replace(story, verdict={**story.verdict, **noisy}))
    assert "noise of the recorded EMG (<code>emg_noise</code>)" in page
    assert "There is nothing to add. No model makes up for" in page
    assert "targets: {models" not in page and "base/rollout" not in page
    noise = story.verdict["rmse_deg"]["base"]["noise"]
    words = re.sub("<[^>]+>", "", page)
    assert "moves the simulated arm by 1.2 deg" in words, "what is left is more than the noise of the angle"
    assert f"that makes about {np.hypot(noise, 1.2):.2g} deg" in words
    both = {**noisy, "effects": ["joint_damping", "emg_noise"], "model": "base+joint_damping"}
    page = write_page(replace(story, verdict={**story.verdict, **both}))
    assert "base+joint_damping/rollout" in page and "noise of the recorded EMG" in page


def test_noise_of_the_emg_that_may_be_something_else_is_told_as_a_condition(facts):
    noisy = {"effects": ["joint_damping", "emg_noise"], "emg_noise": 0.02, "emg_motion_deg": 1.2}
    sure = tell(facts(verdict="effect", **noisy))
    unsure = tell(facts(verdict="class", alternatives=[["emg_noise", "drag"]], **noisy))
    assert " Noise of the recorded EMG (standard" in sure["lead"] and "EMG is such a torque" in sure["missing"]
    assert "If there is noise of the recorded EMG, it (standard" in unsure["lead"]
    assert "EMG would be such a torque" in unsure["missing"]


LONG = {"a": "crosstalk between electrodes", "b": "activation that lags behind the excitation"}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, "Missing: damping of the joint. The error on held-out trials is then 1.7 deg."),
        (
            {"effects": ["emg_noise"], "model": "base", "emg_noise": 0.02},
            "Missing: noise of the recorded EMG. The error",
        ),
        ({"effects": ["a", "b"], "titles": LONG}, "Missing: crosstalk between electrodes and activation that lags"),
        ({"verdict": "class", "alternatives": [["joint_damping", "b"]]}, "damping of the joint or b; these trials"),
        (
            {
                "verdict": "class",
                "effects": ["emg_noise"],
                "alternatives": [["emg_noise", "a"]],
                "titles": {"a": "drag", "emg_noise": "noise of the EMG"},
            },
            "noise of the recorded EMG or drag; these trials",
        ),
        ({"verdict": "partial", "missing_deg": 0.7}, "and something else, worth 0.70 deg of motion."),
        (
            {"verdict": "partial", "rest": "muscle curves or paths of another shape"},
            "and muscle curves or paths of another shape, worth",
        ),
        ({"verdict": "unknown", "effects": [], "missing_deg": 2.0}, "Missing: something that no effect explains."),
        (
            {"verdict": "adequate", "effects": [], "model": "base"},
            "Nothing is missing: the error on held-out trials is 6.4 deg.",
        ),
        ({"verdict": "undecidable", "outside_usual_range": {"f0": ["x"]}}, "cannot tell: a constant is unusual, or"),
        (
            {"follows": False, "model": "base", "horizon_s": 0.5},
            "The muscle model does not follow this arm: 3.0 deg off after half a sec",
        ),
        ({"horizon_s": 0.5}, "error on short pieces of held-out trials is then 1.7 deg"),
    ],
)
def test_the_headline_is_one_short_sentence_with_at_most_one_number(changes, told, facts):
    headline = tell(facts(**changes))["headline"]
    assert told in headline
    assert len(headline.split()) <= 20 + len(changes.get("titles", {})), headline
    assert len(re.findall(r"(?<![\w.])\d[\d.]*", headline)) <= 1, headline


def test_a_class_among_others_is_set_off_from_them(facts, story):
    changes = {"verdict": "class", "effects": ["joint_damping", "gain_per_trial"]}
    changes["alternatives"] = [["gain_per_trial", "emg_noise", "outside"]]
    told = "damping of the joint, and a gain of the EMG that differs between trials or noise of the recorded EMG"
    assert f"{told} or something" in tell(facts(**changes))["named"]
    page = write_page(replace(story, verdict={**story.verdict, **changes}))
    assert "</abbr> that differs between trials or" in page


def test_what_no_effect_was_added_for_changes_no_error(facts):
    """As where damping and what the catalogue lacks are equally likely, and the model without either is."""
    likely = {"alternatives": [["joint_damping", "outside"]], "evidence": {}}
    for kind, model, error in (
        ("class", "base", "6.4"),
        ("effect", "base", "6.4"),
        ("class", "base+joint_damping", "1.7"),
    ):
        told = tell(facts(verdict=kind, model=model, **likely))
        added = model != "base"
        assert told["headline"].startswith("Missing: damping of the joint or something like it")
        assert told["headline"].endswith(f" is then {error} deg." if added else f" is {error} deg.")
        assert ("nothing but noise is left" in told["lead"]) == added == ("No effect was added" not in told["lead"])


@pytest.mark.parametrize(
    ("kind", "hit", "told"),
    [
        ("undecidable", False, "the verdict is open"),
        ("adequate", True, "nothing was"),
        ("effect", False, "something was"),
    ],
)
def test_where_nothing_was_hidden_the_page_says_what_the_verdict_made_of_it(kind, hit, told, facts):
    score = tell(facts(verdict=kind, hidden=[], hit=hit, model="base"))["score"]
    assert f"nothing was hidden in them, and {told}" in score and ("reported" in score) == (kind != "undecidable")


def test_nobody_is_told_to_curl_a_machine_that_the_model_does_not_follow(facts):
    r2 = {"base": -3.0, "posture and speed": 0.8, "motor without physics": 0.9}
    told = tell(facts(follows=False, horizon_s=0.5, model="base", electrodes=[], torque={"held_out": True, "r2": r2}))
    said = " ".join(told[part] for part in ("headline", "lead", "torque", "todo", "plan"))
    assert not told["session"] and not re.search("EMG|muscle|hand", said), said
    assert "alone 0.80; motor without physics 0.90." in told["torque"]
    assert "the model explains R² -3" in told["torque"] and told["headline"].startswith("The model does not follow")


def test_no_network_is_advised_where_there_is_no_emg_for_one(facts):
    with_emg, machine = (facts(electrodes=electrodes) for electrodes in (["emg_biceps"], []))
    machine["command"] = adding_command(machine)
    assert "train a network" in tell(with_emg)["todo"]
    assert not machine["command"] and not re.search("network|train", tell(machine)["todo"] + tell(machine)["add"])


def test_what_to_record_is_told_so_that_a_person_can_do_it(facts):
    proposed = {"question": "a or b", "trial": "passive swing", "separation": 40.0, "now": 2.0}
    assert tell(facts())["plan"] == "No further trial would tell more of what was weighed."
    unsure = tell(facts(verdict="undecidable", effects=[], model="base"))
    assert unsure["plan"] == "More trials like these would tell." and unsure["todo"] == "record more trials like these"
    assert "a helper lifts the forearm" in tell(facts(next_trial=proposed))["plan"]
    assert set(MENU) == set(tell(facts())["do"]), "every trial that can be proposed has its words"
    lost = tell(facts(follows=False, horizon_s=0.5, model="base"))["plan"]
    trials = [line for line in lost.splitlines() if re.match(r"\d+\. ", line)]
    assert len(trials) == 8
    assert all(re.search(r"in the hand: ([\d.]+ kg|nothing); \d+ s\.$", line) for line in trials), trials


@pytest.mark.parametrize(("of_posture", "of_muscles", "little"), [(0.82, 0.93, False), (0.94, 0.74, True)])
def test_that_the_load_says_as_much_as_muscles_is_told_only_where_it_does(of_posture, of_muscles, little, facts):
    r2 = {"posture and speed": 0.47, "posture, speed and load": of_posture, "EMG without physics": 0.97}
    torque = {"held_out": True, "r2": r2 | {"base": of_muscles}}
    told = tell(facts(follows=False, horizon_s=0.5, model="base", torque=torque))
    assert ("hardly needs them" in told["plan"]) == little and len(told["session"]) == 8
    assert "check the constants, the EMG, the loads" in told["plan"]


@pytest.mark.parametrize(
    ("kind", "of_posture"), [("partial", 0.3), ("partial", 0.95), ("effect", 0.3), ("effect", 0.95)]
)
def test_the_headline_and_the_torque_agree_on_whether_a_verdict_on_the_muscles_can_stand(kind, of_posture, facts):
    """Noise takes most of a torque: a model that leaves nothing else of whole trials is no worse for that."""
    r2 = {"base": 0.8, "base+joint_damping": 0.9, "posture and speed": of_posture, "EMG without physics": 0.2}
    told = tell(facts(verdict=kind, torque={"held_out": True, "r2": r2}))
    little, doubtful = of_posture > 0.9, kind == "partial" and of_posture > 0.9
    assert told["headline"].startswith("Doubtful: damping" if doubtful else "Missing: damping")
    assert ("explain less than posture and speed do" in told["torque"]) == little
    for part in ("lead", "torque"):
        assert ("no verdict on the muscles can stand" in told[part]) == doubtful
    assert ("follows the training trials to within noise" in told["torque"]) == (little and not doubtful)


@pytest.mark.parametrize("of_emg", [-1.1, 0.5])
def test_what_explains_less_than_a_constant_torque_tells_nothing(of_emg, facts):
    """However far below 0 the others are; and what below 0 means stands behind the numbers that are."""
    r2 = {"base": -2.9, "posture and speed": -7.2, "posture, speed and load": 0.93, "EMG without physics": of_emg}
    told = tell(facts(follows=False, horizon_s=0.5, model="base", torque={"held_out": True, "r2": r2}))
    assert "EMG and muscles explain less than a constant torque does" in told["lead"]
    del r2["posture, speed and load"]
    assert says_little(facts(model="base", torque={"held_out": True, "r2": r2}))
    assert not re.search("EMG tells|Below 0", told["lead"]) and told["torque"].endswith(
        "Below 0 is worse than a constant torque."
    )


def test_what_is_doubtful_in_the_recordings_is_told(story):
    line = {"check": "mains hum", "where": "trial 2: emg_a", "found": "50 Hz.", "do": "Set notch_hz.", "severity": "x"}
    page = write_page(replace(story, doubts=[line]))
    assert "<b>mains hum</b> (trial 2: emg_a): 50 Hz. Set notch_hz." in page
    assert "doubtful" not in write_page(story)


def test_held_out_trials_that_disagree_with_a_model_that_is_adequate_are_told(facts):
    """The verdict is of the training trials: what the others hold beside it plays no part in it."""
    adequate = facts(verdict="adequate", effects=[], model="base")
    errors = {"train": 0.5, "heldout": 0.6, "fitted": 0.5, "noise": 0.5}
    agree, not_so = (tell({**adequate, "rmse_deg": {"base": errors | {"heldout": error}}}) for error in (0.6, 1.74))
    assert agree["headline"].startswith("Nothing is missing") and "believe neither" not in agree["lead"]
    assert "misses held-out trials by 1.7 deg" in not_so["headline"] and "believe neither" in not_so["lead"]
    assert "like the held-out ones" in not_so["todo"]


def test_values_in_the_text_are_those_of_the_model_that_was_found(facts):
    verdict = facts()
    verdict["parameters"]["base+joint_damping"]["joint_damping.c"] |= {"value": 1.4321, "se": 0.0123}
    assert "c = 1.432 ± 0.012 N m s/rad" in tell(verdict)["lead"]
    anywhere = {**verdict["parameters"]["base+joint_damping"]["joint_damping.c"], "se": 1e6}
    parameters = {**verdict["parameters"], "base+joint_damping": {"joint_damping.c": anywhere}}
    assert "c = 1.432, not known." in tell({**verdict, "parameters": parameters})["lead"]


def test_an_effect_has_the_evidence_given_the_rest_of_the_model_that_was_found(verdict, facts):
    """Damping alone may not pass where it does given other curves."""
    own = verdict["evidence"]["joint_damping"]
    assert own["log_odds"] > 10 and own["without"] == "base"
    model = "base+joint_damping+fatigue"
    evidence = {
        "joint_damping": {"without": "base+fatigue", "log_odds": 321.4},
        "fatigue": {"without": "base+joint_damping", "log_odds": 44.0},
    }
    base = facts()
    like = {
        key: base[key] | {model: base[key]["base"]}
        for key in ("rmse_deg", "parameters", "missing_torque_Nm", "torque_noise_Nm")
    }
    compared = {"torque": "r2", "horizons": "rmse_deg"}
    like |= {n: base[n] | {key: base[n][key] | {model: base[n][key]["base"]}} for n, key in compared.items()}
    like["horizons"]["whole_deg"] = {}
    told = tell({**base, **like, "effects": ["joint_damping", "fatigue"], "model": model, "evidence": evidence})
    text = told["lead"]
    assert "given the muscle model with fatigue, log odds of 321" in text
    assert "given the muscle model with damping of the joint, log odds of 44" in text


def test_the_model_to_start_from_is_told(story):
    assert "is the one to start from: the arm as the settings have it" in write_page(story)


def test_text_from_data_is_escaped(story):
    changed = replace(story, verdict={**story.verdict, "failed": {"base+x": "<script>alert(1)</script>"}})
    page = write_page(changed)
    assert "<script>alert" not in page and "&lt;script&gt;alert" in page
    trials = story.predictions.assign(trial="</script><script>alert(2)</script>")
    assert "<script>alert" not in write_page(replace(story, predictions=trials))


def test_the_page_is_the_same_each_time(story):
    assert write_page(story) == write_page(story)


def test_a_page_of_long_trials_can_still_be_opened_from_the_report(story):
    """Ten minutes at 100 Hz in each of eight trials, with three models: the motion is thinned, and the page says so."""
    time = np.arange(60_000) * 0.01
    motion = pd.DataFrame({"time_s": time, "angle_rad": 1 + np.sin(time), "predicted_rad": 1 + np.cos(time)})
    models = [*story.verdict["rmse_deg"], "base+joint_damping+fatigue"]
    long = [motion.assign(model=m, trial=f"trial{t}", role="train") for m in models for t in range(8)]
    predictions = pd.concat(long).assign(piece=0)
    page = write_page(replace(story, predictions=predictions))
    assert "samples one is drawn" in page
    assert len(page.encode()) < MOST_BYTES


def quiet(story: Story, **errors: float) -> Story:
    """The story of a base model that is adequate, with other errors [deg] than it had."""
    before = {"train": 0.00012, "heldout": 0.00013, "fitted": 0.00012, "noise": 0.06, **errors}
    verdict = {**story.verdict, "verdict": "adequate", "effects": [], "alternatives": [], "model": "base"}
    parts = [{"part": "", "low": t, "high": t + 1, "rmse_deg": 0.07 + 0.1 * t, "mean_deg": 0.0} for t in (0, 1)]
    where = [{"kind": "trend", "of": "time", "unit": "s", "parts": parts}]
    verdict |= {"rmse_deg": {"base": before}, "where": where, "worst_part_deg": 0.17}
    return replace(story, verdict=verdict)


def test_below_the_noise_the_page_finds_nothing_and_says_so_once(story):
    page = write_page(quiet(story))
    assert page.count("nothing to locate") == 1 and "grows with" not in page
    for drawn in ("missing torque over angle", "evidence for each"):
        assert drawn not in page
    above = write_page(quiet(story, fitted=0.1))
    assert "grows with" in above and "missing torque over angle" in above


@pytest.mark.parametrize(
    ("kind", "told", "cut"),
    [
        ("unknown", "no effect is named", "+1 q N m"),
        ("partial", "explains 99 % of what is missing", "100 %"),
        ("class", "Whichever it is, nothing but noise is left", "leaves a choice"),
    ],
)
def test_below_the_headline_the_page_says_how_much_is_claimed_and_not_the_same_again(kind, told, cut, story):
    verdict = {**story.verdict, "verdict": kind, "formula": "+1 q", "explained": 0.9999}
    page = write_page(replace(story, verdict=verdict))
    top = re.sub("<[^>]+>", "", page[page.index("<header>") : page.index("</header>")])
    assert told in top and cut not in top


def test_beside_noise_of_the_emg_no_share_of_the_errors_is_explained(story):
    """It moves the simulated arm, so errors say little of what effects explain."""
    verdict = {**story.verdict, "verdict": "partial", "explained": 0.5}
    shares = [tell({**verdict, "emg_noise": noise})["lead"] for noise in (0.0, 0.02)]
    assert "explains 50 % of what is missing; more is left" in shares[0]
    assert "More is left" in shares[1] and "of what is missing" not in shares[1]


def test_every_error_says_of_what_it_is(story):
    """A model that is judged over pieces stands in one table with networks that run free."""
    assert set(accuracy_cells(story.verdict, story.ladder)["error over"]) == {"whole trials"}
    cells = accuracy_cells({**story.verdict, "horizon_s": 0.5}, story.ladder)
    assert set(cells["error over"]) == {"all of 0.5 s", "the end of 0.5 s", "whole trials"}
    assert not cells.duplicated(["what", "starts from", "error over"]).any(), "one number for one thing"
    network = cells[cells["what"].str.startswith("network")]
    assert set(network["error over"]) == {"whole trials"} and set(network["starts from"]) == {"first angles"}


def test_whole_trials_start_where_the_fit_has_them_and_pieces_where_they_were_measured(story):
    for horizon, start in ((None, "fitted"), (0.5, "measured")):
        verdict = {**story.verdict, "horizon_s": horizon}
        cells = accuracy_cells(verdict, story.ladder)
        starts = set(cells["starts from"]) - {"the best start of each piece", "first angles"}
        assert starts == {f"{start} angle and speed"}
        assert ("the first second of a held-out one" in tell(verdict)["compare"]) == (horizon is None)
    assert BEGINNING_S == 1.0


def test_pieces_from_measured_states_have_no_r2(diagnosis):
    """They start all over the motion, so even one that goes the wrong way has an R2 of the motion near 1."""
    assert ladder_table(diagnosis)["heldout_r2"].notna().all()
    pieces = replace(diagnosis, test=diagnosis.test.cut(0.5))
    assert ladder_table(pieces)["heldout_r2"].isna().all()


def test_a_failed_seed_is_said_in_words(tables, network, story, tmp_path):
    evaluation = pd.concat([network, network.assign(seed=[2, 3], test_rmse_deg=[np.nan, 40.0], test_r2=[np.nan, -0.3])])
    join_ladder(tables["ladder"], [evaluation]).to_csv(tmp_path / "watch.csv", index=False)
    page = write_page(replace(story, ladder=pd.read_csv(tmp_path / "watch.csv")))
    assert "2 of 4 seeds failed (2, 3)" in re.sub("<[^>]+>", "", page)
    assert "failed" not in write_page(story)
    assert (
        join_ladder(tables["ladder"], [network.assign(test_r2=[0.9, np.nan])])["failed_seeds"].iloc[-1]
        == "1 of 2 seeds failed (1)"
    )


def test_every_cell_knows_its_column_on_a_phone(story):
    page = write_page(story)
    for table in re.findall(r"<table.*?</table>", page, re.DOTALL):
        columns = [re.sub("<[^>]+>", "", c) for c in re.findall(r"<th[ >].*?</th>", table)]
        for row in re.findall(r"<tr><td.*?</tr>", table, re.DOTALL):
            assert re.findall(r'data-label="([^"]*)"', row) == columns


@pytest.mark.parametrize(
    ("value", "se", "text"),
    [
        (219.96, 6.77, "220.0 ± 6.8"),
        (244.0, 21.4, "244 ± 21"),
        (0.6, 1.1e-5, "0.600000 ± 0.000011"),
        (-1e-4, 0.031, "0.000 ± 0.031"),
        (1.5, None, "1.5"),
        (299.999, 3e-12, "299.999"),
    ],
)
def test_an_estimate_has_the_digits_that_its_error_leaves(value, se, text):
    assert estimate(value, se) == text


def test_an_estimate_that_may_be_anywhere_within_its_bounds_is_not_known():
    assert estimate(1.06, 2.0, (0.85, 1.15)) == "1.06, not known"
    assert estimate(1.06, 0.1, (0.85, 1.15)) == "1.06 ± 0.10", "its interval, 0.864 to 1.256, leaves out the lower end"
    assert estimate(1.06, 2.0) == "1.1 ± 2.0"
