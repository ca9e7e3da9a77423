"""Readers: what is written in each format comes back, with its names, units, rates and times, and nothing else."""

import gzip
import json
import struct
import types
from contextlib import chdir
from typing import get_args

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from sessions import noraxon

from myowave.data.checks.signals import RAW, signal_problem
from myowave.data.importing import import_trials
from myowave.data.processing.units import plain_unit
from myowave.data.readers import ENDINGS, READERS, read_raw
from myowave.settings import RecordedDataset, TextLayout
from myowave.settings.recording import Format

VALUES = np.round(np.random.default_rng(0).standard_normal(40), 4)
TIME = np.arange(40) / 20


def write(path, text, encoding="utf-8"):
    path.write_text(text, encoding=encoding)
    return path


def rows(separator, *columns, decimal="."):
    lines = [separator.join(f"{v:.10g}" for v in row) for row in zip(*columns, strict=True)]
    return "\n".join(lines).replace(".", decimal) + "\n"


def test_every_ending_stands_for_a_format_that_there_is(tmp_path):
    assert set(ENDINGS.values()) <= set(READERS) == set(get_args(Format))
    with pytest.raises(ValueError, match="'.xyz' says nothing of the format.*Name the format: csv"):
        read_raw(write(tmp_path / "a.xyz", "1"))


# ------------------------------------------------------------------------------------------------ tables of text


@pytest.mark.parametrize(
    ("separator", "decimal", "ending"),
    [
        (",", ".", "csv"),
        (";", ",", "csv"),
        (";", ".", "csv"),
        ("|", ",", "csv"),
        ("\t", ",", "tsv"),
        ("\t", ".", "txt"),
        (" ", ".", "txt"),
        (" ", ",", "txt"),
        (", ", ".", "csv"),
    ],
)
def test_any_dialect_of_a_table_is_told_from_the_file(tmp_path, separator, decimal, ending):
    head = separator.join(["time", "Biceps[uV]", "knee"])
    text = "\ufeff" + head + "\r\n" + rows(separator, TIME, VALUES, 2 * VALUES, decimal=decimal).replace("\n", "\r\n")
    raw = read_raw(write(tmp_path / f"a.{ending}", text))
    assert raw.header == ["Biceps", "knee"] and [s.unit for s in raw.signals] == ["uV", ""]
    assert np.allclose(raw["Biceps"].values, VALUES) and np.allclose(raw["knee"].values, 2 * VALUES)
    assert np.allclose(raw["knee"].time, TIME)
    assert raw.at(0, raw.signals[0]).endswith("row 2")


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-8", "utf-8-sig"])
def test_units_are_read_as_a_spreadsheet_of_any_country_writes_them(tmp_path, encoding):
    text = "time;Bizeps (µV);Ellbogen (°)\n" + rows(";", TIME, VALUES, VALUES)
    raw = read_raw(write(tmp_path / "a.csv", text, encoding))
    assert [plain_unit(signal.unit) for signal in raw.signals] == ["uV", "deg"] and raw.header[0] == "Bizeps"
    assert np.allclose(raw["Ellbogen"].values, VALUES)


def test_what_is_no_text_is_not_taken_for_any(tmp_path):
    (tmp_path / "a.csv").write_bytes(bytes(range(256)))
    with pytest.raises(ValueError, match="not UTF-8 text"):
        read_raw(tmp_path / "a.csv")


def test_decimals_with_commas_may_be_quoted_and_units_spelt_out(tmp_path):
    cells = ['"0,00","1,25"', '"0,01","-2,50"', '"0,02","0,75"']
    raw = read_raw(write(tmp_path / "a.csv", "\n".join(['"time","x (microvolt)"', *cells, ""])))
    assert raw["x"].values.tolist() == [1.25, -2.5, 0.75] and raw["x"].time.tolist() == [0.0, 0.01, 0.02]
    assert plain_unit(raw["x"].unit) == "uV"


@pytest.mark.parametrize("separator", [",", "\t", ";"])
def test_units_may_stand_behind_a_comma_in_names_that_are_quoted_where_commas_separate(tmp_path, separator):
    """As in tables that Noraxon MR3 exports."""
    names = ["Time,s", "Activity", "RT BICEPS BR.,uV", "Elbow RT-Flexion, deg", "Biceps, right"]
    head = separator.join(f'"{name}"' if separator in name else name for name in names)
    samples = [line.replace(separator, 2 * separator, 1) for line in rows(separator, TIME, *[VALUES] * 3).splitlines()]
    raw = read_raw(write(tmp_path / "a.csv", "\n".join([f"Subject{separator}7", head, *samples, ""])))
    assert raw.header == ["Activity", "RT BICEPS BR.", "Elbow RT-Flexion", "Biceps, right"]
    assert [signal.unit for signal in raw.signals] == ["", "uV", "deg", ""]
    assert np.allclose(raw["RT BICEPS BR."].values, VALUES) and np.allclose(raw["Biceps, right"].time, TIME)


@pytest.mark.parametrize("written", ["Biceps (right)", "EMG (triceps)", "Biceps [right, 2]", "EMG (biceps) [%MVC]"])
def test_only_a_unit_in_brackets_is_taken_off_the_name(tmp_path, written):
    signal = read_raw(write(tmp_path / "a.csv", f"time;{written}\n" + rows(";", TIME, VALUES))).signals[0]
    assert (signal.name, plain_unit(signal.unit)) == (written.removesuffix(" [%MVC]"), "%" if "%" in written else "")


@pytest.mark.parametrize("unit", ["Grad", "Deg.", "%MVC", "% MVC", "percent", "°/s", "m/s²", "N", "-", ""])
def test_usual_units_are_known_in_brackets_and_in_a_row_of_their_own(tmp_path, unit):
    for head in (f"time [s];x [{unit}]\n", f"time;x\ns;{unit}\n"):
        raw = read_raw(write(tmp_path / "a.csv", head + rows(";", TIME, VALUES)))
        assert raw.header == ["x"] and raw["x"].unit == unit


def test_whole_numbers_with_commas_between_columns_are_no_decimals(tmp_path):
    raw = read_raw(write(tmp_path / "a.csv", "a,b\n" + "1,2\n" * 10))
    assert np.array_equal(raw["b"].values, np.full(10, 2.0))


def test_header_units_and_times_may_stand_elsewhere(tmp_path):
    text = "Recorder 7\nof May\nX;EMG 1;angle\ns;mV;deg\n" + rows(";", 1000 * TIME, VALUES, VALUES)
    layout = TextLayout(time_column="X")
    raw = read_raw(write(tmp_path / "a.csv", text), None, layout)
    assert [s.unit for s in raw.signals] == ["mV", "deg"] and np.allclose(raw["angle"].time, 1000 * TIME)
    assert raw.at(0, raw.signals[0]).endswith("row 5")
    in_ms = text.replace("\ns;", "\nms;")
    assert np.allclose(read_raw(write(tmp_path / "b.csv", in_ms), None, layout)["angle"].time, TIME)


@pytest.mark.parametrize("blank", ["\n", ";;\n\n"])
def test_blank_rows_may_stand_between_the_names_and_the_samples(tmp_path, blank):
    raw = read_raw(write(tmp_path / "a.csv", f"time;x [mV]\n{blank}" + rows(";", TIME, VALUES)))
    assert np.allclose(raw["x"].values, VALUES) and raw["x"].unit == "mV"
    assert raw.at(0, raw["x"]).endswith(f"row {2 + blank.count(chr(10))}")


@pytest.mark.parametrize("header_row", [None, 1])
def test_blank_rows_may_stand_between_the_names_and_their_units(tmp_path, header_row):
    path = write(tmp_path / "a.csv", "time;x\n\n[s];[mV]\n;\n" + rows(";", TIME, VALUES))
    raw = read_raw(path, None, TextLayout(header_row=header_row))
    assert np.allclose(raw["x"].values, VALUES) and raw["x"].unit == "mV"


def test_where_the_names_stand_may_be_said(tmp_path):
    """Below more rows than are searched, or below one that looks like samples; units may stand below them."""
    samples = rows(",", TIME, VALUES)
    for head, row in (("# note, of many, words\n" * 80, 81), ("17\n", 2)):
        for units in ("", "sec,Deg\n"):
            path = write(tmp_path / "a.csv", f"{head}Clock,Elbow\n{units}{samples}")
            if row == 2:
                assert np.allclose(read_raw(path)["Elbow"].values, VALUES)  # a number above the names is alone
            raw = read_raw(path, None, TextLayout(header_row=row, time_column="Clock"))
            assert np.allclose(raw["Elbow"].values, VALUES) and np.allclose(raw["Elbow"].time, TIME)
            assert plain_unit(raw["Elbow"].unit) == ("deg" if units else "")
            assert raw.at(0, raw.signals[0]) == f"{path}, row {row + 1 + bool(units)}"


def test_rows_of_words_may_stand_between_stated_names_and_the_samples(tmp_path):
    """As LabChart writes them."""
    head = "Interval=\t0,01 s\nChannelTitle=\tBizeps\nRange=\t10,0 mV\nUnitName=\tmV\n"
    path = write(tmp_path / "a.txt", head + rows("\t", TIME, VALUES, decimal=","))
    (signal,) = (raw := read_raw(path, None, TextLayout(header_row=2, time_column="ChannelTitle="))).signals
    assert signal.name == "Bizeps" and np.allclose(signal.values, VALUES) and np.allclose(signal.time, TIME)
    assert raw.at(0, signal) == f"{path}, row 5"


@pytest.mark.parametrize("start", [0.0, -15.0])
def test_times_of_so_many_digits_each_are_even_though_they_have_fewer_decimals_later_on(tmp_path, start):
    time = start + np.arange(30_000) / 2148.148

    def problem(times):
        lines = [f"{t:.7g},{n % 7}" for n, t in enumerate(times)]
        raw = read_raw(write(tmp_path / "a.csv", "\n".join(["time,emg", *lines, ""])))
        return signal_problem(raw, raw["emg"], None, RAW)

    assert problem(time) is None
    assert "time goes from" in problem(time + 1e-4 * (np.arange(len(time)) % 7 == 3))


def test_tables_may_call_their_times_differently(tmp_path):
    layout = TextLayout(time_column=["Clock", "Uhr"])
    for name, unit in (("Clock", "EMG"), ("Uhr", "angle")):
        table = write(tmp_path / "a.csv", f"{name},{unit}\n{rows(',', TIME, VALUES)}")
        (signal,) = read_raw(table, None, layout).signals
        assert signal.name == unit and np.allclose(signal.time, TIME)
    other = write(tmp_path / "a.csv", f"Horloge,q\n{rows(',', TIME, VALUES)}")
    with pytest.raises(ValueError, match="no column 'Clock' or 'Uhr' of times; the columns are Horloge, q. Name"):
        read_raw(other, None, layout)


@pytest.mark.parametrize(
    "names",
    ["time,emg,time,angle", "time_emg,emg,time_angle,angle", "T [s],emg,T angle [ms],angle", "t,emg,angle time,q"],
)
def test_two_recorders_in_one_table_each_have_their_times_whatever_ends_first(tmp_path, names):
    slow, factor = 2 * TIME[: len(TIME) // 2], 1000 if "ms" in names else 1
    for first in (True, False):
        pairs = [(TIME, VALUES), (slow, VALUES[: len(slow)])][:: 1 if first else -1]
        columns = [a for (time, values), k in zip(pairs, (1, factor), strict=True) for a in (k * time, values)]
        cells = [[f"{c[n]:.9g}" if n < len(c) else "" for c in columns] for n in range(len(TIME))]
        raw = read_raw(write(tmp_path / "a.csv", "\n".join([names, *map(",".join, cells)]) + "\n"))
        for signal, (time, values) in zip(raw.signals, pairs, strict=True):
            assert np.allclose(signal.time, time) and np.allclose(signal.values, values) and not signal.odd


@pytest.mark.parametrize("separator", [",", " "])
def test_names_may_stand_behind_a_mark_of_comments(tmp_path, separator):
    """As NumPy's savetxt writes them."""
    text = separator.join(["# time", "emg"]) + "\n" + rows(separator, TIME, VALUES)
    raw = read_raw(write(tmp_path / "a.csv", text))
    assert raw.header == ["emg"] and np.allclose(raw["emg"].time, TIME)


def test_what_goes_on_after_the_only_times_end_has_none(tmp_path):
    raw = read_raw(write(tmp_path / "b.csv", "\n".join(["time,angle,emg", "0,1,1", "1,2,2", ",,3", ""])))
    assert len(raw["emg"].values) == 3 and np.isnan(raw["emg"].time[2])


@pytest.mark.parametrize(
    ("text", "layout", "says"),
    [
        ("a,b\n1,2,3\n4,5,6\n", {}, "2 names of columns .a, b., but 3 columns below"),
        ("a,b\n", {}, "1 rows; expected names of columns in row 1 and samples"),
        ("a,b\n1,2\n", {"time_column": "t"}, "no column 't' of times; the columns are a, b"),
        ("time[h],b\n1,2\n", {}, "times are in 'h'; expected s or ms"),
        ("a;b\n1;2\n3;4;5\n", {}, "rows differ in their number of columns"),
        ("time_s\n0\n1\n2\n", {}, "no signal in it; expected numbers of at least one beside its time"),
    ],
)
def test_a_table_that_cannot_be_read_says_why(tmp_path, text, layout, says):
    with pytest.raises(ValueError, match=f"a.csv: .*{says}|a.csv: {says}"):
        read_raw(write(tmp_path / "a.csv", text), None, TextLayout(**layout))


def test_cells_that_are_no_numbers_are_kept_for_the_message(tmp_path):
    raw = read_raw(write(tmp_path / "a.csv", "a\n1\nlost\n\n3\n"))
    assert raw["a"].odd == {1: "lost", 2: ""} and np.isnan(raw["a"].values[1])


def test_a_parquet_table_of_raw_signals_has_its_times(tmp_path):
    pd.DataFrame({"time_s": TIME, "b": VALUES}).to_parquet(tmp_path / "a.parquet")
    raw = read_raw(tmp_path / "a.parquet")
    assert raw.header == ["b"] and np.array_equal(raw["b"].time, TIME)


# ------------------------------------------------------------------------------------------------------- recorders


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ".")])
def test_delsys_channels_have_times_and_rates_of_their_own(tmp_path, separator, decimal):
    slow = VALUES[:10]
    lines = [f"{TIME[n]:g}{separator}{VALUES[n]:g}{separator}" for n in range(40)]
    lines = [line + (f"{4 * TIME[n]:g}{separator}{slow[n]:g}" if n < 10 else separator) for n, line in enumerate(lines)]
    head = ["X [s]", "Avanti sensor 1: EMG 1 [V]", "X [s]", "Avanti sensor 1: ACC X [g]"]
    rate = f"Sampling frequency: 20{decimal}5"
    about = f"Label: Avanti sensor 1: EMG 1 {rate} Number of points: 40 start: 0 Unit: V\n\n"
    text = about + separator.join(head) + "\n" + "\n".join(lines).replace(".", decimal) + "\n"
    raw = read_raw(write(tmp_path / "a.csv", text), "delsys")
    emg, acc = raw.signals
    assert (emg.name, emg.unit, emg.rate) == ("Avanti sensor 1: EMG 1", "V", 20.5) and acc.unit == "g"
    assert np.allclose(emg.values, VALUES) and np.allclose(emg.time, TIME)
    assert np.allclose(acc.values, slow) and np.allclose(acc.time, 4 * TIME[:10]) and acc.rate is None
    assert not emg.odd and not acc.odd


def nexus(path, model=",,deg,deg,deg"):
    """Write a device of four samples a frame and an angle whose last value is missing, as Vicon Nexus exports them."""
    device = [f"{n // 4 + 11},{n % 4},{v:g},{2 * v:g}" for n, v in enumerate(VALUES)]
    angle = [f"{n + 11},0,{v:g},0,{v + 1:g}" for n, v in enumerate(VALUES[:9])] + ["20,0,,0,0"]
    blocks = [
        ["Devices", "80", ",,Imported EMG - Voltage,", "Frame,Sub Frame,Voltage.BIC,Voltage.TRI", ",,V,V", *device],
        ["Model Outputs", "20", ",,Jane:RElbowAngles,,", "Frame,Sub Frame,X,Y,Z", model, *angle],
    ]
    return write(path, "\n\n".join("\n".join(block) for block in blocks) + "\n")


def test_a_vicon_export_is_read_block_by_block_on_one_clock_and_without_the_subjects_name(tmp_path):
    raw = read_raw(nexus(tmp_path / "a.csv"), "vicon")
    assert raw.header == ["Voltage.BIC", "Voltage.TRI", *(f"RElbowAngles {axis}" for axis in "XYZ")]
    emg, angle = raw["Voltage.TRI"], raw["RElbowAngles X"]
    assert (emg.unit, emg.rate, angle.unit, angle.rate) == ("V", 80.0, "deg", 20.0)
    assert np.allclose(emg.values, 2 * VALUES) and np.allclose(emg.time, 0.5 + np.arange(40) / 80)
    assert np.allclose(angle.values[:9], VALUES[:9]) and np.allclose(angle.time, 0.5 + np.arange(10) / 20)
    assert angle.odd == {9: ""} and (tmp_path / "a.csv").read_text().splitlines()[angle.first_row + 8] == "20,0,,0,0"


def test_a_vicon_export_that_is_not_whole_says_where(tmp_path):
    with pytest.raises(ValueError, match="no row begins with Frame, Sub Frame"):
        read_raw(write(tmp_path / "a.csv", "time,a\n1,2\n"), "vicon")
    cut = nexus(tmp_path / "b.csv").read_text().partition("11,0,")[0]
    with pytest.raises(ValueError, match="b.csv, row 4: expected above it a row with the kind of data"):
        read_raw(write(tmp_path / "b.csv", cut), "vicon")


@pytest.mark.parametrize("intervals", [False, True])
def test_trigno_discover_names_sensors_above_their_channels_and_rates_below(tmp_path, intervals):
    head = [
        "Application:,Trigno Discover (2.1.0.7)",
        "Date/Time:,5/6/2025 10:11:12 AM",
        "Collection Length (seconds):,2",
        "BICEPS (82345),,,,TRICEPS (82346)",
        "sensor mode: 40,,,,sensor mode: 40",
        "EMG 1 Time Series (s),EMG 1 (mV),ACC X Time Series (s),ACC X (G),EMG 1 Time Series (s),EMG 1 (mV),EMG 2 (mV)",
        ",20 Hz,,5 Hz,,20 Hz,20 Hz",
        *([",0.05 s,,0.2 s,,0.05 s,0.05 s,,Type,Name,Label,Time (s)"] if intervals else []),
    ]
    slow = [f"{t:g},{v:g}" for t, v in zip(4 * TIME[:10], VALUES, strict=False)] + [","] * 30
    lines = [f"{t:g},{v:g},{s},{t:g},{2 * v:g},{3 * v:g}" for t, v, s in zip(TIME, VALUES, slow, strict=True)]
    if intervals:
        lines = [lines[0], lines[1] + ",,General,start,,0.3", *lines[2:], ",,,,,,,,General,end,,1.2"]
    raw = read_raw(write(tmp_path / "a.csv", "\n".join([*head, *lines]) + "\n"), "delsys")
    assert raw.header == ["BICEPS EMG 1", "BICEPS ACC X", "TRICEPS EMG 1", "TRICEPS EMG 2"]
    assert [(s.unit, s.rate, len(s.values)) for s in raw.signals] == [
        ("mV", 20.0, 40),
        ("G", 5.0, 10),
        ("mV", 20.0, 40),
        ("mV", 20.0, 40),
    ]
    assert np.allclose(raw["TRICEPS EMG 2"].values, 3 * VALUES) and np.allclose(raw["TRICEPS EMG 2"].time, TIME)
    assert np.allclose(raw["BICEPS ACC X"].time, 4 * TIME[:10]) and not any(s.odd for s in raw.signals)
    assert raw.at(0, raw.signals[0]).endswith(f"row {9 if intervals else 8}")


def test_a_delsys_file_with_commas_for_everything_is_refused(tmp_path):
    text = "X [s],EMG [V]\n" + "0,1,0,5\n" * 5
    with pytest.raises(ValueError, match="2 names of columns .*, but 4 columns below.*need a point"):
        read_raw(write(tmp_path / "a.csv", text), "delsys")
    with pytest.raises(ValueError, match=r"no row begins with X \[s\]"):
        read_raw(write(tmp_path / "b.csv", "time,a\n1,2\n"), "delsys")


@pytest.mark.parametrize(
    ("separator", "said", "unit"),
    [
        ("\t", "inDegrees=yes", "deg"),
        (",", "inDegrees=no", "rad"),
        (" ", "inDegrees = yes", "deg"),
        ("\t", "nRows=40", ""),
    ],
)
def test_opensim_says_in_its_header_whether_angles_are_degrees(tmp_path, separator, said, unit):
    head = f"Coordinates\nversion=1\n{said}\nnColumns=3\nendheader\n"
    text = head + separator.join(["time", "r_elbow_flex", "r_shoulder"]) + "\n" + rows(separator, TIME, VALUES, VALUES)
    raw = read_raw(write(tmp_path / "a.mot", text))
    assert raw.header == ["r_elbow_flex", "r_shoulder"] and {s.angle_unit for s in raw.signals} == {unit}
    assert np.allclose(raw["r_shoulder"].values, VALUES) and np.allclose(raw["r_shoulder"].time, TIME)
    assert raw.at(0, raw.signals[0]).endswith("row 7")
    with pytest.raises(ValueError, match="no row with endheader"):
        read_raw(write(tmp_path / "b.sto", "time\tq\n0\t1\n"))


def test_matlab_variables_columns_and_fields_are_signals(tmp_path):
    content = {"emg": np.stack([VALUES, 2 * VALUES]), "fs": 20.0, "trial": {"angle": VALUES, "time": TIME}, "who": "x"}
    savemat(tmp_path / "a.mat", content)
    raw = read_raw(tmp_path / "a.mat")
    assert raw.header == ["emg(1)", "emg(2)", "trial.angle"]
    assert np.allclose(raw["emg(2)"].values, 2 * VALUES) and raw["emg(1)"].rate == 20.0
    assert np.allclose(raw["trial.angle"].time, TIME) and raw["trial.angle"].rate is None
    cell = np.empty(3, dtype=object)
    cell[:] = [VALUES, "note", 2 * VALUES[: len(VALUES) // 2]]
    sensors = np.array([("a", VALUES), ("b", 3 * VALUES)], dtype=[("name", object), ("x", object)])
    savemat(tmp_path / "c.mat", {"emg": cell, "fs": 20.0, "sensor": sensors})
    raw = read_raw(tmp_path / "c.mat")
    rates = {"emg(1)": 20.0, "emg(3)": None, "sensor(1).x": None, "sensor(2).x": None}
    assert {s.name: s.rate for s in raw.signals} == rates  # what has half the samples is not of the rate of the others
    assert np.allclose(raw["sensor(2).x"].values, 3 * VALUES)
    slow = {"angle": VALUES[:10], "emg_t": VALUES}
    clocks = {"fsEMG": 20.0, "fs_angle": 5.0, "heart_rate": 60.0, "time_angle_ms": 4000 * TIME[:10], "time_emg": TIME}
    savemat(tmp_path / "d.mat", slow | clocks)
    raw = read_raw(tmp_path / "d.mat")
    assert [(s.name, s.rate) for s in raw.signals] == [("angle", 5.0), ("emg_t", 20.0)]
    assert np.allclose(raw["emg_t"].time, TIME) and np.allclose(raw["angle"].time, 4 * TIME[:10])
    savemat(tmp_path / "e.mat", slow | {"heart_rate": 60.0, "fs_force": 1000.0})
    assert {signal.rate for signal in read_raw(tmp_path / "e.mat").signals} == {None}
    with pytest.raises(ValueError, match="not a MATLAB file"):
        read_raw(write(tmp_path / "b.mat", "hello, this is text" * 20))
    savemat(tmp_path / "f.mat", {"fs": 20.0, "emg": VALUES + 1j})
    assert len(read_raw(tmp_path / "f.mat")["emg"].odd) == len(VALUES)  # told where it is asked for
    savemat(tmp_path / "c.mat", {"name": "x"})
    with pytest.raises(ValueError, match="no vector or matrix"):
        read_raw(tmp_path / "c.mat")


def edf(path, digital, *, bits=16, kind=b"", low=-3200.0, high=3200.0, per_record=20, seconds=1.0):
    """Write one signal and an annotation channel as EDF or BDF, from its specification."""
    width = bits // 8
    ends = 2 ** (bits - 1)

    def cells(*values, size):
        return b"".join(str(value).encode().ljust(size) for value in values)

    magic = b"\xffBIOSEMI" if bits == 24 else b"0       "
    count = len(digital) // per_record
    fixed = magic + b"X M 01-JAN-1980 Jane_Doe".ljust(80) + b"Startdate".ljust(80) + b"01.01.8000.00.00"
    fixed += cells(256 * 3, size=8) + kind.ljust(44) + cells(count, size=8) + cells(seconds, size=8) + cells(2, size=4)
    about = cells("EMG BB", "EDF Annotations", size=16) + cells("", "", size=80) + cells("uV", "", size=8)
    about += cells(low, -1, size=8) + cells(high, 1, size=8)
    about += cells(-ends, -ends, size=8) + cells(ends - 1, ends - 1, size=8)
    about += cells("", "", size=80) + cells(per_record, 4, size=8) + cells("", "", size=32)
    body = b""
    for n in range(count):
        for value in digital[n * per_record : (n + 1) * per_record]:
            body += struct.pack("<i", int(value))[:width]
        body += b"\x00" * 4 * width
    path.write_bytes(fixed + about + body)
    return path


@pytest.mark.parametrize("bits", [16, 24])
def test_edf_and_bdf_give_physical_values_and_no_name(tmp_path, bits):
    ends = 2 ** (bits - 1)
    digital = np.array([-ends, ends - 1, 0, -1, 1, *np.random.default_rng(1).integers(-ends, ends, 35)])
    raw = read_raw(edf(tmp_path / f"a.{'bdf' if bits == 24 else 'edf'}", digital, bits=bits))
    assert raw.header == ["EMG BB"] and raw.signals[0].unit == "uV" and raw.signals[0].rate == 20.0
    values = raw.signals[0].values
    assert values[0] == -3200.0 and values[1] == pytest.approx(3200.0)
    assert np.allclose(np.diff(values), np.diff(digital) * 6400 / (2 * ends - 1))
    assert "Doe" not in repr(raw)


def test_an_edf_that_was_interrupted_or_cut_short_is_refused(tmp_path):
    with pytest.raises(ValueError, match="interrupted"):
        read_raw(edf(tmp_path / "a.edf", np.zeros(40), kind=b"EDF+D"))
    whole = edf(tmp_path / "b.edf", np.zeros(40)).read_bytes()
    (tmp_path / "b.edf").write_bytes(whole[:-5])
    with pytest.raises(ValueError, match="cut short"):
        read_raw(tmp_path / "b.edf")
    with pytest.raises(ValueError, match="not an EDF"):
        read_raw(write(tmp_path / "c.edf", "x" * 300))


def test_bids_sidecars_fill_in_what_a_recording_does_not_say(tmp_path):
    folder = tmp_path
    write(folder / "sub-01_task-curl_emg.csv", "BB\tTB\n" + rows("\t", VALUES, VALUES))
    write(folder / "sub-01_task-curl_channels.tsv", "name\ttype\tunits\nBB\tEMG\tmV\nTB\tEMG\tn/a\n")
    write(folder / "sub-01_task-curl_emg.json", json.dumps({"SamplingFrequency": 20}))
    raw = read_raw(folder / "sub-01_task-curl_emg.csv")
    assert [s.unit for s in raw.signals] == ["mV", ""] and {s.rate for s in raw.signals} == {20.0}


def test_c3d_is_read_where_its_package_is_there_and_else_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "ezc3d", None)
    with pytest.raises(ValueError, match=r"need the package ezc3d: pip install 'myowave\[c3d\]'"):
        read_raw(write(tmp_path / "a.c3d", "x"))
    content = {  # as ezc3d gives it
        "parameters": {
            "ANALOG": {
                "LABELS": {"value": ["EMG.BB", "EMG.TB"]},
                "UNITS": {"value": ["V", "V"]},
                "RATE": {"value": np.array([1000.0])},
            },
            "POINT": {
                "LABELS": {"value": ["RELB", "RElbowAngles"]},
                "UNITS": {"value": ["mm"]},
                "ANGLES": {"value": ["RElbowAngles"]},
                "RATE": {"value": np.array([100.0])},
            },
        },
        "data": {"analogs": np.stack([VALUES, -VALUES])[None], "points": np.arange(4 * 2 * 4.0).reshape(4, 2, 4)},
    }
    monkeypatch.setitem(__import__("sys").modules, "ezc3d", types.SimpleNamespace(c3d=lambda path: content))
    for order, machine in (("<", 84), (">", 86)):  # a block each for the header and the parameters
        head = struct.pack(f"{order}2B4H", 2, 80, 2, 20, 11, 14).ljust(512, b"\0")
        (tmp_path / "a.c3d").write_bytes(head + bytes([1, 80, 1, machine]))
        raw = read_raw(tmp_path / "a.c3d")
    (tmp_path / "cut.c3d").write_bytes(head.replace(b"\0\x0e", b"\0\x0f") + bytes([1, 80, 1, 86]))
    with pytest.raises(ValueError, match="4 frames, but its header says 5; the file was cut short"):
        read_raw(tmp_path / "cut.c3d")
    assert np.array_equal(raw["EMG.TB"].values, -VALUES) and (raw["EMG.TB"].unit, raw["EMG.TB"].rate) == ("V", 1000.0)
    assert raw["RELB.x"].unit == "mm" and (raw["RElbowAngles.y"].unit, raw["RElbowAngles.y"].rate) == ("deg", 100.0)
    assert np.array_equal(raw["RElbowAngles.y"].values, content["data"]["points"][1, 1])


# ------------------------------------------------------------------------------------------ formats in one session


def test_a_session_may_mix_formats_rates_and_units(tmp_path):
    """EMG of two muscles in one .mat in mV, the angle in rad in an OpenSim file, columns besides."""
    time, fine = np.arange(0, 6, 0.01), np.arange(0, 6, 0.001)
    for seed, trial in enumerate(("p", "q")):
        noise = np.random.default_rng(seed).standard_normal((2, len(fine)))
        emg = 0.05 * noise * (0.1 + np.maximum(np.sin(2 * np.pi * fine / 3), 0.0))
        savemat(tmp_path / f"{trial}.mat", {"emg": emg, "fs": 1000.0, "force": fine})
        head = "q\ninDegrees=no\nendheader\ntime\televation\telbow\n"
        angle = 1 + 0.8 * np.sin(2 * np.pi * time / 3 - 0.5 + seed)
        write(tmp_path / f"{trial}.mot", head + rows("\t", time, time, angle))
    section = {
        "kind": "recorded",
        "trials": ["p", "q"],
        "test": ["q"],
        "emg": {
            f"emg_{m}": {"file": "{trial}.mat", "column": f"emg({n})", "unit": "mV"}
            for n, m in ((1, "biceps"), (2, "triceps"))
        },
        "angle": {"file": "{trial}.mot", "column": "elbow"},
        "ignore_columns": ["force", "elev*"],
    }
    with chdir(tmp_path):
        prepared, _ = import_trials("me", RecordedDataset(**section))
    assert prepared.trials.lengths == (600, 600) and prepared.trials.dt == pytest.approx(0.01)
    assert 10 < prepared.gains["emg_biceps"] < 100  # uV
    assert prepared.trials.angle[0, :600] == pytest.approx(1 + 0.8 * np.sin(2 * np.pi * time / 3 - 0.5), abs=1e-8)
    for change, says in (
        ({"ignore_columns": ["force"]}, "p.mot: column elevation is not used"),
        (
            {"angle": {"file": "{trial}.mot"}},
            "holds elevation, elbow; name one of them in data.datasets.me.angle.column",
        ),
        ({"angle": {"file": "{trial}.mot", "column": "elbo"}}, "column 'elbo' is not there; did you mean 'elbow'"),
        (
            {"angle": {"file": "{trial}.mot", "column": "elbow", "rate_hz": 50.0}},
            "50 Hz by rate_hz, 100 Hz by its times",
        ),
    ):
        with chdir(tmp_path), pytest.raises(ValueError, match=says):
            import_trials("me", RecordedDataset(**section | change))


# --------------------------------------------------------------------------------------------------- damaged files


def good_file(folder, form):
    """A file of a format that can be read."""
    path = folder / f"a.{ {'matlab': 'mat', 'opensim': 'mot', 'parquet': 'parquet', 'edf': 'edf'}.get(form, 'csv') }"
    table = rows(",", TIME, VALUES)
    if form == "edf":
        return edf(path, np.arange(40))
    if form == "matlab":
        savemat(path, {"emg": VALUES, "fs": 20.0}, do_compression=True)
    elif form == "parquet":
        pd.DataFrame({"time_s": TIME, "b": VALUES}).to_parquet(path)
    elif form == "gz":
        (path := folder / "a.csv.gz").write_bytes(gzip.compress(f"time,b\n{table}".encode()))
    elif form == "noraxon":
        noraxon(path, "b", VALUES, 20.0, "uV")
    elif form == "vicon":
        nexus(path)
    else:
        head = {"csv": "time,b\n", "delsys": "X [s],b [V]\n", "opensim": "inDegrees=yes\nendheader\ntime,b\n"}
        write(path, head[form] + table)
    return path


DAMAGES = {
    "cut in half": lambda content: content[: len(content) // 2],
    "all but the end": lambda content: content[:-3],
    "empty": lambda content: b"",
    "zeros": lambda content: bytes(len(content)),
    "another head": lambda content: content[::-1][:60] + content[60:],
    "noise inside": lambda content: content[:150] + bytes(b ^ 0x55 for b in content[150:200]) + content[200:],
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("form", ["csv", "gz", "parquet", "noraxon", "delsys", "vicon", "opensim", "matlab", "edf"])
def test_a_damaged_file_is_named_or_read_as_far_as_it_goes(tmp_path, form, damage):
    path = good_file(tmp_path, form)
    assert read_raw(path, None if form == "gz" else form).header
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    try:
        raw = read_raw(path, None if form == "gz" else form)
    except ValueError as error:
        assert str(path) in str(error) and str(error).endswith((".", "\n", "')."))
    else:
        assert form not in ("gz", "parquet"), "formats with a checksum see it"
        assert all(len(signal.values) <= 60 for signal in raw.signals)


def test_sidecars_that_cannot_be_read_are_named(tmp_path):
    write(tmp_path / "sub-01_emg.csv", "BB\n" + rows(",", VALUES))
    write(tmp_path / "sub-01_emg.json", "{SamplingFrequency: 20")
    with pytest.raises(ValueError, match="sub-01_emg.json: this is not JSON"):
        read_raw(tmp_path / "sub-01_emg.csv")
    write(tmp_path / "sub-01_emg.json", "{}")
    write(tmp_path / "sub-01_channels.tsv", "name\tsampling_frequency\nBB\tfast\n")
    with pytest.raises(ValueError, match="sub-01_channels.tsv: a sampling_frequency is no number.*fast"):
        read_raw(tmp_path / "sub-01_emg.csv")
