// Measured and predicted motion, drawn with uPlot: a trial at a time, models ticked on and off, zoomed by dragging.
"use strict";
(() => {
  const box = document.getElementById("motion");
  const told = JSON.parse(document.getElementById("motion-data").textContent);
  const MEASURED = "#000000", FIRST = "#D55E00", FOUND = "#0072B2", NETWORK = "#009E73";
  const OTHERS = ["#E69F00", "#CC79A7", "#56B4E9"];
  const others = told.models.map((_, i) => i).filter(i => i && i !== told.found);
  const network = i => told.models[i].startsWith("network");
  const color = i => i === 0 ? FIRST : i === told.found ? FOUND : network(i) ? NETWORK : OTHERS[others.indexOf(i) % OTHERS.length];
  const dash = i => i === 0 ? [8, 5] : i === told.found ? [] : [2, 4];
  const text = value => value == null ? "" : value.toFixed(2);
  let trial = told.trials.find(t => t.held_out) || told.trials[0];

  function numbers() {
    const time = trial.measured.map((_, i) => trial.begin_s + i * trial.step_s);
    const measured = trial.measured.map(a => a === null ? null : a / 1000);
    const predicted = trial.predicted.map(p => p.map(a => a === null ? null : a / 1000));
    const left = predicted.map(p => p.map((a, i) => a === null || measured[i] === null ? null : measured[i] - a));
    return [[time, measured, ...predicted], [time, ...left]];
  }

  const lines = told.models.map((name, i) =>
    ({label: name, stroke: color(i), dash: dash(i), width: 1.6, points: {show: false}, value: (u, v) => text(v)}));
  const seconds = {label: "time [s]", value: (u, v) => text(v)};
  const axes = (label, x) => [{label: x, size: x ? 44 : 24, labelSize: 18, font: "12px sans-serif", labelFont: "13px sans-serif"},
                              {label, size: 62, labelSize: 18, font: "12px sans-serif", labelFont: "13px sans-serif"}];
  const width = () => Math.max(280, box.clientWidth);
  // A model that runs away hides nothing: pictures reach as far beyond what was measured as that moves.
  const ends = () => [Math.min, Math.max].map(end => end(...trial.measured.filter(a => a !== null)) / 1000);
  const near = (u, low, high) => {
    const [least, most] = ends(), span = most - least;
    return uPlot.rangeNum(Math.max(low ?? least, least - span), Math.min(high ?? most, most + span), 0.1, true);
  };
  const around = (u, low, high) => {
    const [least, most] = ends(), noise = 1.5 * told.noise_deg, span = Math.max(most - least, noise);
    return [Math.max(Math.min(1.1 * (low ?? 0), -noise), -span), Math.min(Math.max(1.1 * (high ?? 0), noise), span)];
  };
  const shared = {cursor: {sync: {key: "motion"}, drag: {x: true, y: false}}};
  let following = false;
  const follow = (u, key) => {
    if (key !== "x" || following || plots.length < 2) return;
    following = true;
    const {min, max} = u.scales.x;
    for (const other of plots) if (other !== u) other.setScale("x", {min, max});
    following = false;
  };
  const hooks = {setScale: [follow]};
  const plots = [];
  const [angles, left] = numbers();
  const legend = {mount: (u, table) => box.querySelector(".values").append(table)};  // what stands at the cursor
  plots.push(new uPlot({...shared, hooks, legend, scales: {x: {time: false}, y: {range: near}}, width: width(), height: 300, axes: axes("angle [deg]", ""),
    series: [seconds, {label: "measured", stroke: MEASURED, width: 2.4, points: {show: false}, value: (u, v) => text(v)}, ...lines]},
    angles, box.querySelector(".angles")));
  plots.push(new uPlot({...shared, hooks, scales: {x: {time: false}, y: {range: around}}, width: width(), height: 190, legend: {show: false},
    axes: axes("error [deg]", "time [s]"), series: [seconds, ...lines]}, left, box.querySelector(".left")));

  box.plots = plots;  // for whoever looks from outside, such as a test

  const resize = (wide, tall = 300) => plots.forEach((p, i) => p.setSize({width: wide, height: i ? 190 : tall}));
  addEventListener("resize", () => resize(width()));
  addEventListener("beforeprint", () => resize(680, 225));
  addEventListener("afterprint", () => resize(width()));

  box.querySelector("select").addEventListener("change", event => {
    trial = told.trials[event.target.value];
    numbers().forEach((data, i) => plots[i].setData(data));
  });
  box.querySelector("select").value = told.trials.indexOf(trial);
  box.querySelectorAll("input[type=checkbox]").forEach((tick, i) => {
    tick.parentElement.style.setProperty("--line", color(i));
    tick.addEventListener("change", () => plots.forEach((p, at) => p.setSeries(i + (at ? 1 : 2), {show: tick.checked})));
  });
  const [first, last] = [() => plots[0].data[0][0], () => plots[0].data[0][plots[0].data[0].length - 1]];
  const moves = {
    in: (a, b) => [a + (b - a) / 4, b - (b - a) / 4],
    out: (a, b) => [a - (b - a) / 2, b + (b - a) / 2],
    earlier: (a, b) => a - (b - a) / 2 < first() ? [first(), first() + b - a] : [a - (b - a) / 2, b - (b - a) / 2],
    later: (a, b) => b + (b - a) / 2 > last() ? [last() - (b - a), last()] : [a + (b - a) / 2, b + (b - a) / 2],
    all: () => [first(), last()],
  };
  box.querySelectorAll("button").forEach(button => button.addEventListener("click", () => {
    const {min, max} = plots[0].scales.x;
    const [from, to] = moves[button.value](min, max);
    plots[0].setScale("x", {min: Math.max(first(), from), max: Math.min(last(), to)});
  }));
})();
