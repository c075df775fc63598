"""Studies with one mistake each."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from catching import LEFT, caught_study
from honest_study import COLUMNS, HonestStudy

from lsds.contracts import StudyTable
from lsds.errors import DataError
from lsds.testing import studies


@caught_study(studies.check_constructing_measures_nothing, "the constructor accessed open .*mutants_studies")
class ReadsInTheConstructor(HonestStudy):
    def __init__(self, options, context):
        super().__init__(options, context)
        with open(__file__, encoding="utf-8") as file:
            self.data = file.read()


@caught_study(studies.check_constructing_measures_nothing, "constructing started .*left-over")
class StartsAThread(HonestStudy):
    def __init__(self, options, context):
        super().__init__(options, context)
        end = threading.Event()
        LEFT.append(end.set)
        threading.Thread(target=end.wait, name="left-over", daemon=True).start()


@caught_study(studies.check_constructing_measures_nothing, "constructing took")
class MeasuresInTheConstructor(HonestStudy):
    def __init__(self, options, context):
        super().__init__(options, context)
        time.sleep(1.05)


class Ticks(HonestStudy):
    """Reports what `ticks` yields in place of the honest progress."""

    def run(self, tick):
        for done, whole in self.ticks():
            tick(done, whole)
        return super().run(lambda done, whole: None)


@caught_study(studies.check_progress_reaches_its_end, r"never called tick\(\)")
class ReportsNothing(Ticks):
    def ticks(self):
        return []


@caught_study(studies.check_progress_reaches_its_end, r"the last call is tick\(2, 3\)")
class StopsOneShort(Ticks):
    def ticks(self):
        return [(0, 3), (1, 3), (2, 3)]


@caught_study(studies.check_progress_reaches_its_end, "done falls")
class CountsDown(Ticks):
    def ticks(self):
        return [(2, 3), (1, 3), (3, 3)]


@caught_study(studies.check_progress_reaches_its_end, "between 0 and whole")
class CountsTooFar(Ticks):
    def ticks(self):
        return [(3, 3), (4, 3)]


@caught_study(studies.check_progress_reaches_its_end, "both are whole numbers")
class ReportsShares(Ticks):
    def ticks(self):
        return [(0.5, 1), (1, 1)]


@caught_study(studies.check_prints_nothing, r"run\(\) printed 'throwing'")
class Prints(HonestStudy):
    def run(self, tick):
        print("throwing")
        return super().run(tick)


@caught_study(studies.check_result_has_a_title, r"run\(\) returned SimpleNamespace")
class ReturnsAnotherType(HonestStudy):
    def result(self, rows):
        return SimpleNamespace(title="throws", columns=COLUMNS, rows=rows)


@caught_study(studies.check_result_has_a_title, r"run\(\) raised DataError: no ball; set options")
class RaisesDataError(HonestStudy):
    def result(self, rows):
        raise DataError("no ball")


@caught_study(studies.check_result_has_a_title, "has several lines")
class TitleOfTwoLines(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), title="throws\nof a ball")


@caught_study(studies.check_result_has_a_title, "title is ''")
class NoTitle(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), title="")


@caught_study(studies.check_result_has_a_title, "notes is 'no wind'; return a list")
class OneNote(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), notes="no wind")


@caught_study(studies.check_columns_are_named, r"column 1 is \('m', 'm'\)")
class ColumnWithoutAFormat(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), columns=(COLUMNS[0], ("m", "m"), COLUMNS[2]))


@caught_study(studies.check_columns_are_named, "two columns have the key 'm'")
class OneKeyTwice(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), columns=(*COLUMNS, COLUMNS[1]))


@caught_study(studies.check_rows_have_a_cell_for_each_column, "row 1 has no 'm'; write None")
class LacksACell(HonestStudy):
    def row(self, i, distance_m):
        row = super().row(i, distance_m)
        return {key: cell for key, cell in row.items() if (i, key) != (1, "m")}

    def result(self, rows):
        return replace(super().result([{"m": 0.0, **row} for row in rows]), rows=rows)


@caught_study(studies.check_rows_have_a_cell_for_each_column, "row 0: 'far' is bool")
class NumpyBools(HonestStudy):
    def row(self, i, distance_m):
        return {**super().row(i, distance_m), "far": np.bool_(distance_m > 20.0)}


@caught_study(studies.check_rows_have_a_cell_for_each_column, r"more\[0\], row 0: 'm' is list")
class AListInAFurtherTable(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), more=[StudyTable((("m", "m", ""),), [{"m": [1.0]}])])


@caught_study(studies.check_formats_fit_the_rows, r"'name' is 'throw 0', which the format '\.1f' does not take")
class FormatsTextAsANumber(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), columns=(("name", "throw", ".1f"), *COLUMNS[1:]))


@caught_study(studies.check_formats_fit_the_rows, r"'m' is .*, which the format 'd' does not take")
class FormatsAFloatAsAWholeNumber(HonestStudy):
    def result(self, rows):
        return replace(super().result(rows), columns=(COLUMNS[0], ("m", "m", "d"), COLUMNS[2]))


@caught_study(studies.check_draws_a_png, "begins with b'<svg")
class DrawsAnSvg(HonestStudy):
    def draw(self, path):
        path.write_text("<svg></svg>")


@caught_study(studies.check_draws_a_png, "wrote nothing; write to the path")
class DrawsNothing(HonestStudy):
    def draw(self, path):
        pass


@caught_study(studies.check_draws_a_png, r"draw\('picture.png'\) wrote \['picture.png.png'\]")
class AddsAnEnding(HonestStudy):
    def draw(self, path):
        super().draw(path.with_name(path.name + ".png"))


@caught_study(studies.check_same_seed_same_rows, "row 0: 'm' is .* in one run and")
class DrawsFromTheGlobalGenerator(HonestStudy):
    def row(self, i, distance_m):
        return super().row(i, distance_m + np.random.random())  # noqa: NPY002


@caught_study(studies.check_same_seed_same_rows, "row 0: 'taken_s' is .*; use .*`timed`")
class HidesItsTimes(HonestStudy):
    timed = ()
