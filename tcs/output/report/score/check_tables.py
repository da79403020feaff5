"""Tables of a score report about its reliability: the verification, and success under error."""

from __future__ import annotations

from tcs.output.report.blocks import Cell, Column, Table, Tone
from tcs.output.report.score.report import ScoreReport
from tcs.output.words import member_text, percent, percentage
from tcs.output.words.verification import check_lines


def verification_table(report: ScoreReport) -> Table:
    """Return the result of the verification, and its verdict."""
    found = report.verification
    rows: list[list[Cell | str]] = []
    for line in check_lines(found.to_json()):
        value: Cell | str = line.value
        if line.text == "false":
            value = Cell(line.value, _tone(found.false_reached == 0))
        rows.append([f"– {line.text}" if line.is_detail else _sentence_case(line.text), value])
    verdict = found.verdict
    if found.is_sound and not report.is_sound:
        verdict = "THESE ANSWERS HOLD, BUT SOME POSTURES IN THE SECTION GOALS ARE FALSE"
    rows.append(["Verdict", Cell(verdict, _tone(report.is_sound))])
    return Table(
        "Verification made with this report: pairs drawn at random from all state tables of the "
        f"file, seed {report.sizes.seed}.",
        [Column("Check", is_number=False), Column("Result")],
        rows,
    )


def success_table(report: ScoreReport) -> Table | None:
    """Return the estimated success under error; None if the file holds no estimates."""
    success = report.success
    if success is None:
        return None
    sets = report.scored.sets
    named = [("the set shown here", report.shown.stored)]
    named += [
        (f"most robust set of {'one' if most == 1 else f'up to {most}'}", members)
        for most in range(1, success.members.shape[1] + 1)
        if (members := success.most_robust(sets, max_members=most))
    ]
    rows: list[list[Cell | str]] = []
    for name, members in named:
        row = success.row_of(members) if members else None
        reachability, manipulability = sets.scores_of(members) if members else (0.0, 0.0)
        poses = [member_text(report.job.grid.configuration(h).to_json()) for h in members]
        estimate = ["no estimate", "–", "–"]
        if row is not None:
            low, high = percent(float(success.low[row])), percent(float(success.high[row]))
            mean = percentage(float(success.success[row]))
            estimate = [mean, f"{low} to {high}", f"{int(success.samples[row]):,}"]
        rows.append(
            [
                name,
                " and ".join(poses) or "none",
                percentage(reachability),
                f"{manipulability:.3f}",
                *estimate,
            ]
        )
    return Table(
        "Estimated percentage of the goals reached in the randomly perturbed environment. The most "
        "robust set has the greatest lower confidence bound.",
        [
            Column("Set", is_number=False),
            Column("Configurations", is_number=False),
            Column("P_R"),
            Column("P_M"),
            Column("Under error"),
            Column("95% interval"),
            Column("Samples"),
        ],
        rows,
    )


def _tone(is_good: bool) -> Tone:
    return "good" if is_good else "bad"


def _sentence_case(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}"
