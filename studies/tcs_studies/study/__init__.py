"""Studies with people: trials in counterbalanced order, and the questionnaires after them.

In: a folder with `study.yaml` (conditions, trials, questionnaires, the line) and one file per
participant. Out: the next step of a participant, recorded step by step, and the values that the
tables of both papers are made from. Modules: `study_file` (the plan), `forms` (the questionnaires),
`steps` (their sequence), `participants` (the files), `recording` (one participant's session),
`trials` (checks of a run) and `results` (values by condition).
"""
