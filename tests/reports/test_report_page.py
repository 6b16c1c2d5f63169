"""Pages of HTML that need nothing beside themselves."""

import base64
from html.parser import HTMLParser

from hypothesis import given
from hypothesis import strategies as st

from manikin.reports.report_page import ReportPage

VOID = {"meta", "img"}


class Reader(HTMLParser):
    """Keeps the texts, and checks that every element is closed."""

    def __init__(self, html):
        super().__init__()
        self.open, self.texts, self.seen = [], [], []
        self.feed(html)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@given(st.text(alphabet=st.characters(codec="utf-8", exclude_characters="\r\x00"), min_size=1, max_size=40))
def test_any_text_is_shown_as_it_is(text):
    page = ReportPage(text, text)
    page.heading(text)
    page.remarks([text])
    page.table((text,), [(text,)])
    read = Reader(page.html())
    assert "".join(read.texts).count(text) >= 6
    assert [tag for tag, _ in read.seen].count("script") == 0


def test_a_page_needs_no_other_file():
    page = ReportPage("A page")
    page.picture(b"\x89PNG not quite", "a picture")
    page.table(
        ("file", "value"), [("walk.bvh", 0.123456), ("none", None)], links={"walk.bvh": "walk/report.html"}
    )
    read = Reader(page.html())
    (picture,) = [attributes for tag, attributes in read.seen if tag == "img"]
    kind, data = picture["src"].split(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data) == b"\x89PNG not quite"
    assert [attributes["href"] for tag, attributes in read.seen if tag == "a"] == ["walk/report.html"]
    assert {tag for tag, attributes in read.seen if "src" in attributes} == {"img"}
    assert "0.1235" in read.texts
