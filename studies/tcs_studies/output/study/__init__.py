"""A participant's session at the screen: trials in the live page, questionnaires in the browser.

In: the steps of a participant (`tcs_studies.study.recording`). Out: their records. Modules:
`session` (what is due, one step after the other), `page` (a form as a page without script) and
`server` (checks and records answers, for this machine only).
"""
