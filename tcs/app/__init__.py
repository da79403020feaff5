"""The page for people, `tcs app`: plain HTML and scripts of our own over the service.

In: the application of a service. Out: the same application with the page. Every file of the page is
in this package, and the page sends requests only to the server that it came from.
"""

from __future__ import annotations

from tcs.app.pages import LANGUAGES, add_page

__all__ = ["LANGUAGES", "add_page"]
