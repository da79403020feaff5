"""Tables of a score report about its reliability: the verification, and success under error."""

from __future__ import annotations

from tcs.output.report.blocks import Cell, Column, Table, Tone
from tcs.output.report.score.report import ScoreReport
from tcs.output.report.score.shown_set import estimate_of
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
    shown = report.shown
    named = [("the set shown here", shown.members, report.scores, shown.success)]
    for most in range(1, success.members.shape[1] + 1):
        if flat := success.most_robust(sets, max_members=most):
            name = f"most robust set of {'one' if most == 1 else f'up to {most}'}"
            configurations = tuple(report.job.grid.configuration(h) for h in flat)
            named.append((name, configurations, sets.scores_of(flat), estimate_of(success, flat)))
    rows: list[list[Cell | str]] = []
    for name, members, scores, found in named:
        estimate = ["no estimate", "–", "–"]
        if found is not None:
            interval = f"{percent(found.low)} to {percent(found.high)}"
            estimate = [percentage(found.mean), interval, f"{found.samples:,}"]
        rows.append(
            [
                name,
                " and ".join(member_text(member.to_json()) for member in members) or "none",
                percentage(scores[0]),
                f"{scores[1]:.3f}",
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
