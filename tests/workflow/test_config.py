"""The workflow and its configuration: what stops it, and what each rule is told."""

SECRET = "1.234567"
HIDDEN = {
    "targets": {"datasets": ["case1"], "models": {"case1": ["base", "base+joint_damping"]}},
    "data": {"datasets": {"case1": {"hidden_effect": {"joint_damping": {"c": float(SECRET)}}}}},
}
MAY_KNOW_WHAT_IS_HIDDEN = {"simulate_trials"}
MAY_READ_THE_TRUTH = {"evaluate_model", "score_verdict"}
DECIDING = {"decompose_scales", "train_scale", "diagnose_dataset"}
SCORED = ("truth.json", "verdict.json", "evaluation.csv", "watch.csv", "watch_parameters.csv")


def test_a_wrong_configuration_stops_before_any_job_with_our_message_only(project):
    """Further mistakes are told alike: tests/settings."""
    wrong = {"learning": {"recipes": {"rollout": {"hiden": 3}}, "seeds": "five"}}
    done = project.snakemake("--cores", "1", *project.lay_over(wrong))
    assert done.returncode != 0
    assert "learning.recipes.rollout.hiden: unknown key; did you mean 'hidden'?" in done.stdout
    assert "learning.seeds = 'five': expected a whole number" in done.stdout
    assert "Traceback" not in done.stdout and not (project.folder / "results").exists()


def test_what_is_trained_diagnosed_and_compared_is_what_the_targets_name(project):
    targets = {
        "datasets": ["case1", "case2"],
        "without_networks": ["bench_elbow"],
        "scales": [2],
        "own_recipes": {"case1": ["rollout", "paper_split"]},
        "follow_verdict": [],
    }
    wanted = project.planned(*project.lay_over({"targets": targets}))
    assert wanted["train_scale"] == 3 * 2 and wanted["evaluate_model"] == wanted["draw_models"] == 3
    assert wanted["tell_verdict"] == wanted["draw_trials"] == 3 and wanted["import_trials"] == 1
    assert wanted["score_baselines"] == 2
    none = {"sweep": None, "baselines": dict.fromkeys(("hold", "ridge", "trees", "gru_plain", "cnn"))}
    left = project.planned(*project.lay_over({"targets": targets, "learning": none}))
    assert left == {job: count for job, count in wanted.items() if job != "score_baselines"}


def test_recordings_that_cannot_be_found_are_named_in_a_line(project):
    files = {"data": {"datasets": {"bench_elbow": {"files": ["data/nothing/*.csv"]}}}}
    done = project.snakemake("-n", *project.lay_over(files))
    assert done.returncode != 0 and "Traceback" not in done.stdout
    assert "bench_elbow.files: data/nothing/*.csv: no such file; looked for" in done.stdout


def test_a_configuration_that_cannot_be_read_is_one_line(project):
    (project.folder / "mine.yaml").write_text("targets: [")
    done = project.snakemake("-n", "--configfile", "config.yaml", "mine.yaml")
    assert done.returncode != 0 and "Traceback" not in done.stdout
    assert "mine.yaml is not valid YAML, line 1" in done.stdout
    assert len(done.stdout.splitlines()) <= 3, done.stdout


OWN = """
targets: {datasets: [me], scales: [1]}
physics:
  arms:
    paper:
      muscles:
        Bi: {side: flexor, emg: emg_biceps, f0_N: 300.0, l0_m: 0.6, vmax_m_s: 6.0, slack_m: 0.55, l1_m: 0.3, l2_m: 0.8}
        Tri: {side: extensor, emg: emg_triceps, f0_N: 300.0, l0_m: 0.4, vmax_m_s: 4.0, slack_m: 0.33, l1_m: 0.2,
              l2_m: 0.7}
      joint: {mass_kg: 1.0, length_m: 1.0}
data: {datasets: {me: {kind: measured, files: [data/bench_elbow/*.csv], test: [trial3]}}}
learning:
  recipes: {rollout: {method: rollout, epochs: 5}}
  sweep: {dataset: me, recipe: rollout, dimensions: {learning_rate: {low: 0.001, high: 1.0, log: true}}}
"""


def test_a_configuration_of_ones_own_needs_none_of_the_datasets_that_ship(project):
    (project.folder / "config.yaml").write_text(OWN)
    planned = project.planned("all", "sweep")
    assert planned["import_trials"] == planned["train_scale"] == planned["tell_verdict"] == 1
    assert "search_settings" in planned


def test_no_rule_is_told_what_is_hidden_but_the_one_that_puts_it_in(project):
    project.finish(*project.lay_over(HIDDEN))
    jobs = project.recorded()
    made = {"simulate_trials", "train_scale", "evaluate_model", "diagnose_dataset", "tell_verdict", "publish_runs"}
    assert {job["rule"] for job in jobs} >= made
    assert {job["rule"] for job in jobs if SECRET in str(job["params"])} == MAY_KNOW_WHAT_IS_HIDDEN
    readers = {job["rule"] for job in jobs if any("truth" in path for path in job["input"])}
    assert readers == MAY_READ_THE_TRUTH
    deciding = [job for job in jobs if job["rule"] in DECIDING]
    assert {job["rule"] for job in deciding} == DECIDING
    assert not [path for job in deciding for path in job["input"] if path.endswith(SCORED)], "scores do not flow back"


def test_a_script_does_not_see_the_configuration(project):
    spy = """
from pathlib import Path
for path in snakemake.output:
    Path(path).write_text(f"config: {snakemake.config}")
"""
    (project.folder / "workflow/scripts/import_trials.py").write_text(spy)
    done = project.snakemake("--cores", "1", "results/data/bench_elbow/trials.parquet", *project.lay_over(HIDDEN))
    assert done.returncode == 0, done.stdout
    assert (project.folder / "results/data/bench_elbow/trials.parquet").read_text() == "config: {}"
