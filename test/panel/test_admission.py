"""Whom the page lets in: origins, hosts and tokens."""

import pytest

from tri_glide_kinematics.panel.admission import Admission, Request, is_loopback, shown

TOKEN = "Ab_" * 14
ADMISSION = Admission("127.0.0.1", TOKEN)


def refusal(
    host: str = "127.0.0.1:8080",
    origin: str | None = None,
    cookie: str | None = f"tri_glide_panel_8080={TOKEN}",
    path: str = "/",
) -> str:
    origins = [] if origin is None else [origin]
    cookies = [] if cookie is None else [cookie]
    found = ADMISSION.refusal(Request(path, [host], origins, cookies))
    return found.reason if found is not None else ""


@pytest.mark.parametrize(
    ("origin", "host", "is_own"),
    [
        # Of a program, or of a browser that asks for the page itself.
        (None, "127.0.0.1:8080", True),
        ("http://127.0.0.1:8080", "127.0.0.1:8080", True),
        ("http://localhost:8080", "localhost:8080", True),
        ("http://[::1]:8080", "[::1]:8080", True),
        ("http://192.168.0.7:8080", "192.168.0.7:8080", True),
        ("http://127.0.0.1:8081", "127.0.0.1:8080", False),
        ("https://elsewhere.example", "127.0.0.1:8080", False),
        # A name that its owner has let lead to this machine.
        ("http://rebound.example:8080", "rebound.example:8080", False),
        (None, "rebound.example:8080", False),
        (None, "localhost.example:8080", False),
        (None, "127.0.0.1.example:8080", False),
        (None, "0x7f.1:8080", False),
        (None, "someone@127.0.0.1:8080", False),
        (None, "127.0.0.1:8080:8080", False),
        (None, "127.0.0.1:99999", False),
        (None, "[::1:8080", False),
        (None, "", False),
        ("null", "127.0.0.1:8080", False),
        ("", "127.0.0.1:8080", False),
        ("ftp://127.0.0.1:8080", "127.0.0.1:8080", False),
        ("http://127.0.0.1:8080/", "127.0.0.1:8080", False),
    ],
)
def test_whose_page_it_is(origin: str | None, host: str, is_own: bool) -> None:
    assert refusal(host, origin, path=f"/?token={TOKEN}") is not is_own


@pytest.mark.parametrize(
    ("cookie", "path"),
    [
        (f"tri_glide_panel_8080={TOKEN}", "/"),
        (f"a=b; tri_glide_panel_8080={TOKEN};c", "/"),
        # An old cookie beside the new one.
        (f"tri_glide_panel_8080=old; tri_glide_panel_8080={TOKEN}", "/"),
        (None, f"/?token={TOKEN}"),
        (None, f"/?a=b&token={TOKEN}"),
        ("tri_glide_panel_8080=old", f"/?token={TOKEN}"),
    ],
)
def test_the_token_is_in_the_cookie_or_in_the_address(cookie: str | None, path: str) -> None:
    assert not refusal(cookie=cookie, path=path)


@pytest.mark.parametrize(
    ("cookie", "path"),
    [
        (None, "/"),
        ("", "/?"),
        ("tri_glide_panel_8080=", "/?token="),
        # Of the panel on another port.
        (f"tri_glide_panel_8081={TOKEN}", "/"),
        (f"tri_glide_panel_8080={TOKEN[:-1]}", f"/?token={TOKEN}x"),
        (f"tri_glide_panel_8080={TOKEN.lower()}", f"/#?Token={TOKEN}"),
        ("tri_glide_panel_8080=\udcff", "/?token=%ff\udcff\u20ac"),
    ],
)
def test_all_else_is_refused(cookie: str | None, path: str) -> None:
    assert "token" in refusal(cookie=cookie, path=path)


def test_headers_that_come_twice_are_refused() -> None:
    cookies = [f"tri_glide_panel_8080={TOKEN}"]
    host, origin = "127.0.0.1:8080", "http://127.0.0.1:8080"
    assert ADMISSION.refusal(Request("/", [host], [origin], cookies)) is None
    assert ADMISSION.refusal(Request("/", [host, host], [origin], cookies))
    assert ADMISSION.refusal(Request("/", [], [], cookies))
    assert ADMISSION.refusal(Request("/", [host], [origin, "http://elsewhere.example"], cookies))


def test_a_name_that_was_given_is_ours() -> None:
    request = Request(f"/?token={TOKEN}", ["Robot:8080"])
    assert Admission("robot", TOKEN).refusal(request) is None
    assert Admission("0.0.0.0", TOKEN).refusal(request)


def test_what_is_logged_is_short_and_in_one_line() -> None:
    assert shown(["a\nb\x1b[31m" + "c" * 10_000]).startswith("'a\\nb\\x1b[31mccc")
    assert len(shown(["\udcff" * 10_000])) < 100


@pytest.mark.parametrize(
    ("host", "is_own"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("robot", False)],
)
def test_loopback(host: str, is_own: bool) -> None:
    assert is_loopback(host) is is_own
