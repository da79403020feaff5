"""Live trials of a study: their beginning, their end, and what is recorded."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.output.view.teleop.controls import BACK, CLUTCH, NEXT_MODE
from tcs.output.view.teleop.session import CONDITION_MODES
from tcs_studies.output.study.trial_session import TrialSession
from tcs_studies.study.participants import new_participant
from tcs_studies.study.recording import StudyRecording
from tcs_studies.study.study_file import DRIVEN
from tests.studies.study.example import LINE, small_study

FORWARD, UP = "move x [m/s]", "move z [m/s]"


@pytest.fixture
def study(tmp_path, iiwa):
    """A study whose line is 5 cm long, straight ahead of the start posture."""
    start = iiwa.kinematics(np.array(LINE["joints"])).p
    line = {**LINE, "start": tuple(start), "end": tuple(start + np.array([0.05, 0.0, 0.0]))}
    return small_study(tmp_path, line=line, time_limit=1.0, training=0, trials=3)


class Script:
    """Actions of an operator by control step, and the control loop of a page without its clock."""

    def __init__(self, session):
        self.page, self.steps, self.actions = session._session.page, 0, {}
        self.page.run = self.run

    def at(self, step, action, *arguments):
        self.actions[self.steps + step] = lambda: action(*arguments)

    def run(self, duration):
        for _ in range(round(duration / self.page.session.settings.period)):
            self.actions.pop(self.steps, lambda: None)()
            self.page.step()
            self.steps += 1


@pytest.fixture
def session(study, desk):
    found = TrialSession(study, "novel", port=None, on_stop=lambda _: None)
    found._session.page.operator.source = desk
    yield found
    found.close()


@pytest.fixture
def script(session):
    return Script(session)


def test_conditions_that_are_driven_are_those_of_the_live_page():
    assert set(DRIVEN) == set(CONDITION_MODES)


def test_a_trial_ends_at_the_end_of_the_line_and_is_recorded(study, session, script, desk):
    recording = StudyRecording(study, new_participant(study))
    recording = StudyRecording(
        study, recording.participant.model_copy(update={"order": ["novel", "end-effector"]})
    )
    recording.skip("none")
    for _ in range(2):
        # Every trial begins with the sliders at zero.
        script.at(20, desk.sliders.__setitem__, FORWARD, 0.1)
        run = session.run()
        assert run.metadata["condition"] == "novel"
        np.testing.assert_array_equal(run.joints[0], LINE["joints"])
        measures = recording.record_run(run)
        assert measures.finished == 1.0
        # 3 cm at 0.1 m/s, and the acceleration.
        assert 0.29 < measures.time < 0.4
        # The samples of a plane are up to 5 mm from it along the line.
        assert measures.accuracy < 5e-3
    assert recording.next_step.key == "novel/trial-3"


def test_a_trial_ends_at_its_time_limit_since_the_first_motion(session, script, desk):
    script.at(50, desk.sliders.__setitem__, UP, 0.03)
    run = session.run()
    # Half a second of waiting, the time limit of a second, and the interval of the check.
    assert 1.5 <= run.time[-1] - run.time[0] < 1.65


def test_back_to_the_start_begins_the_trial_again(session, script, desk):
    script.at(10, desk.sliders.__setitem__, UP, 0.03)
    script.at(90, desk.press, BACK)
    script.at(130, desk.sliders.__setitem__, FORWARD, 0.1)
    run = session.run()
    # Over a second since the first motion: the time since the return counts.
    assert run.time[-1] - run.time[0] > 1.3
    assert np.linalg.norm(run.position[-1] - session._course.line.end) <= 0.02


def test_modes_and_clutch_are_reset_between_trials(session, script, desk):
    operator = session._session.page.operator
    script.at(10, desk.press, NEXT_MODE)
    script.at(12, desk.press, CLUTCH)
    script.run(0.2)
    assert operator.clutch
    assert operator.mode is operator.modes[1]
    session._session.begin()
    assert (operator.mode, operator.clutch) == (operator.modes[0], False)


def test_a_trial_without_an_operator_is_not_recorded(session, script):
    assert session.run(0.05) is None
