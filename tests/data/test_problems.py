"""A mistake that is in many files is said once."""

from myowave.data.problems import say_once


def test_problems_of_many_files_that_differ_in_numbers_only_are_one():
    rows = [f"t{n}.csv, row {7 * n}: time is '{n},5', not {-n}; see /home/t{n}.csv." for n in range(1, 12)]
    (line,) = say_once(rows)
    assert line.startswith(rows[0]) and line.count("see /home") == 1
    assert "Likewise in 10 more: t2.csv, row 14; t3.csv, row 21;" in line and "t9.csv, row 63 and 2 others." in line


def test_problems_that_are_of_one_file_or_name_other_columns_stay_apart():
    apart = ["t1.csv: EMG 1 is lost.", "t1.csv: EMG 2 is lost.", "t1.csv: 'EMG3' is lost.", "t2.csv: 'EMG4' is lost."]
    assert say_once(apart) == apart
    nowhere = ["x reaches 7; expected 1. It is in %: divide.", "y reaches 8; expected 1. It is in %: divide."]
    assert say_once([*nowhere, "Lost.", "Found."]) == [*nowhere, "Lost.", "Found."]
    merged = say_once([*apart[:2], "t2.csv: EMG 1 is lost.", "t2.csv: EMG 2 is lost."])
    assert merged == [f"{line} Likewise in 1 more: t2.csv." for line in apart[:2]]
