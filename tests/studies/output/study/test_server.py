"""Questionnaires through HTTP: a simulated participant, double submits, wrong values."""

from __future__ import annotations

import http.client
import re
import threading
from html.parser import HTMLParser
from urllib.parse import urlencode, urlsplit

import pytest

from tcs.errors import OutputError
from tcs_studies.output.study.server import FormServer
from tcs_studies.study.participants import load_participant, new_participant
from tcs_studies.study.recording import StudyRecording
from tests.studies.study.example import answers_to, run_on, small_study


class Fields(HTMLParser):
    """Fields of a page with their attributes, and the ids that exist and are referred to."""

    def __init__(self, page):
        super().__init__()
        self.fields, self.ids, self.referred, self.tags = [], [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.tags.append((tag, found))
        if tag in ("input", "textarea"):
            self.fields.append(found)
        if "id" in found:
            self.ids.append(found["id"])
        for name in ("for", "aria-describedby"):
            self.referred += found.get(name, "").split()
        if found.get("href", "").startswith("#"):
            self.referred.append(found["href"][1:])


class Participant:
    """A browser: cookies and scripts are not needed."""

    def __init__(self, server):
        self.where = urlsplit(server.url)

    def request(self, method, path=None, body=None, **headers):
        connection = http.client.HTTPConnection(self.where.hostname, self.where.port, timeout=10)
        try:
            connection.request(method, path or self.where.path, body, headers)
            reply = connection.getresponse()
            return reply.status, reply.headers, reply.read().decode()
        finally:
            connection.close()

    def page(self):
        status, _, page = self.request("GET")
        assert status == 200
        return page

    def post(self, fields, **headers):
        sent = {"Content-Type": "application/x-www-form-urlencoded", **headers}
        return self.request("POST", None, urlencode(fields, doseq=True), **sent)


@pytest.fixture
def recording(tmp_path):
    study = small_study(tmp_path, training=0)
    return StudyRecording(study, new_participant(study))


@pytest.fixture
def server(recording):
    found = FormServer(recording, port=None, refresh=True)
    yield found
    found.close()


@pytest.fixture
def participant(server):
    return Participant(server)


def filled(recording, place=0, **changes):
    """The fields that a browser sends for the form that is due."""
    step = recording.next_step
    form = recording.form(step)
    answers = answers_to(form, place)
    fields = {"step": step.key}
    for i, question in enumerate(form.questions):
        fields[f"q{i}"] = str(answers.get(question.key, ""))
    return {**fields, **changes}


def on_disk(recording):
    return load_participant(recording.study, recording.participant.participant)


def test_a_participant_fills_in_all_forms(recording, participant):
    seen = []
    while (step := recording.next_step) is not None:
        page = participant.page()
        if step.form is None:
            assert "Next: trial 1 of 1" in page
            assert '<meta http-equiv="refresh"' in page
            recording.record_run(run_on(recording.study, step.condition))
            continue
        assert f'value="{step.key}"' in page
        status, headers, _ = participant.post(filled(recording, len(seen)))
        assert (status, headers["Location"]) == (303, participant.where.path)
        seen.append(step.form)
        # Saved before the reply.
        assert on_disk(recording).steps[step.key].answers is not None
    each = ["van-der-laan", "tlx-ratings", "tlx-pairs", "difficulty"]
    assert seen == ["background", *each, *each, "preference"]
    assert "Thank you" in participant.page()
    laan = on_disk(recording).steps["novel/van-der-laan"].answers
    assert len(laan) == 9
    assert set(laan.values()) <= {1, 2, 3, 4, 5}


def test_a_double_submit_is_one_answer(recording, participant):
    fields = filled(recording, 4)
    replies = []
    both = [
        threading.Thread(target=lambda: replies.append(participant.post(fields)[0]))
        for _ in range(4)
    ]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert replies == [303] * 4
    assert on_disk(recording).steps["background"].answers == {"age": 20, "experience": "some"}
    assert recording.progress()[0] == 1


def test_other_answers_after_a_step_back_are_not_taken(recording, participant):
    first = filled(recording, 4)
    participant.post(first)
    status, _, page = participant.post({**first, "q0": "50"})
    assert status == 409
    assert "first answers are kept" in page
    assert on_disk(recording).steps["background"].answers["age"] == 20


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q0": "7"}, "is &#x27;7&#x27;; must be a whole number from 16 to 120"),
        ({"q0": "<script>"}, "&lt;script&gt;"),
        ({"q2": "expert"}, "must be none, some, much"),
        ({"q0": ["30", "31"]}, "is answered twice"),
        ({"q9": "1"}, "not a question of this form"),
        ({"q1": "x" * 2001}, "2,000 at most"),
    ],
)
def test_wrong_values_are_reported_on_the_page_and_not_saved(
    recording, participant, changes, message
):
    status, _, page = participant.post(filled(recording, 4, **changes))
    assert status == 422
    assert message in page
    assert "<script" not in page
    assert on_disk(recording).steps == {}
    # What was filled in is still there.
    assert '<input type="radio" name="q2" value="some" checked>' in page or "q2" in changes


def test_open_questions_of_a_scale_are_reported(recording, participant):
    recording.skip("none")
    recording.record_run(run_on(recording.study, "end-effector"))
    fields = filled(recording, 1)
    del fields["q3"]
    status, _, page = participant.post(fields)
    assert status == 422
    assert '<a href="#q3">nice – annoying</a> is not answered' in page
    assert page.count(" checked>") == 8
    assert "end-effector/van-der-laan" not in on_disk(recording).steps


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        ("step=background", {"Content-Type": "application/json"}, 400),
        ("step=background", {"Content-Length": "-1"}, 400),
        ("step=background", {"Content-Length": "999999999"}, 400),
        ("step=nowhere", {}, 400),
        ("step=end-effector/trial-1", {}, 400),
        ("&".join(f"a{i}=1" for i in range(200)), {}, 400),
        ("step=%ff", {}, 400),
        ("", {}, 400),
    ],
    ids=["type", "length", "too long", "step", "trial", "fields", "encoding", "empty"],
)
def test_requests_that_are_no_forms_are_refused(recording, participant, body, headers, status):
    sent = {"Content-Type": "application/x-www-form-urlencoded", **headers}
    got, _, page = participant.request("POST", None, body, **sent)
    assert got == status
    assert "Not saved" in page
    assert on_disk(recording).steps == {}


def test_other_addresses_and_names_of_the_host_are_refused(recording, participant):
    for path in ("/", "/favicon.ico", participant.where.path + "x"):
        assert participant.request("GET", path)[0] == 404
    assert participant.request("GET", Host="example.org")[0] == 404
    status, _, _ = participant.post(filled(recording), Host="example.org")
    assert status == 404
    assert on_disk(recording).steps == {}


def test_pages_load_nothing_and_run_nothing(recording, participant):
    status, headers, page = participant.request("GET")
    assert status == 200
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Cache-Control"] == "no-store"
    assert re.findall(r"(?:src|href|action)=\"(?!#|data:,|\")[^\"]*", page) == []
    assert "<script" not in page


def test_fields_have_labels_and_names_that_exist(recording, participant):
    recording.skip("none")
    while (step := recording.next_step) is not None:
        if step.form is None:
            recording.record_run(run_on(recording.study, step.condition))
            continue
        page = participant.page()
        found = Fields(page)
        assert sorted(found.ids) == sorted(set(found.ids))
        assert set(found.referred) <= set(found.ids)
        radios = sum(one.get("type") == "radio" for one in found.fields)
        texts = sum(one.get("type") in ("text", "number", None) for one in found.fields)
        assert page.count("<label>") == radios
        assert page.count('<label class="above"') == texts
        assert page.count("<legend>") == page.count("<fieldset")
        assert page.count("required") >= radios
        # No step of a scale is marked beforehand.
        assert "checked>" not in page
        participant.post(filled(recording))


def test_a_closed_page_loses_nothing(recording, participant, server):
    participant.post(filled(recording, 4))
    recording.record_run(run_on(recording.study, "end-effector"))
    half = Participant(server)
    half.page()
    server.close()
    resumed = StudyRecording(recording.study, on_disk(recording))
    assert resumed.next_step.key == "end-effector/van-der-laan"
    again = FormServer(resumed, port=None, refresh=False)
    try:
        assert again.url != server.url
        assert 'value="end-effector/van-der-laan"' in Participant(again).page()
    finally:
        again.close()


def test_a_full_disk_is_reported_on_the_page(recording, participant, monkeypatch):
    def full(*_):
        raise OutputError("Participant 'P01.json' cannot be written: No space left on device.")

    monkeypatch.setattr("tcs_studies.study.recording.save_participant", full)
    status, _, page = participant.post(filled(recording, 4))
    assert status == 500
    assert "No space left on device" in page
    assert 'value="20"' in page
    monkeypatch.undo()
    assert participant.post(filled(recording, 4))[0] == 303


def test_a_wait_ends_when_the_form_is_saved_or_the_time_is_over(recording, participant, server):
    step = recording.next_step
    assert not server.wait(step, 0.05)
    later = threading.Timer(0.05, lambda: participant.post(filled(recording)))
    later.start()
    assert server.wait(step, 10.0)
    later.join()


def test_a_taken_port_is_an_error_in_a_line(recording, server):
    port = urlsplit(server.url).port
    with pytest.raises(OutputError, match=f"cannot listen at port {port}"):
        FormServer(recording, port=port, refresh=False)


def test_only_this_machine_can_connect(server):
    assert urlsplit(server.url).hostname == "127.0.0.1"
    assert len(urlsplit(server.url).path) > 20
