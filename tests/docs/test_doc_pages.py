# SPDX-License-Identifier: GPL-3.0-or-later
"""The documentation's pages: links and their anchors, and the files and names that the text mentions."""

import re
from functools import cache
from pathlib import Path

from tests.support.doc_pages import PAGES, blocks, place_of, prose_of, spans, text_of
from tests.support.programs import REPOSITORY

CODE = ("bridge", "fleet", "payloads", "protocols", "reports", "service", "simulator", "storage", "terminal")
GENERATED = ("build", "dist")
LINK = re.compile(r"\]\(([^)\s]+)\)")
#: What the blocks of each language are tested by.
LANGUAGES = {
    "sh": "tests/docs/test_doc_commands.py",
    "toml": "tests/docs/test_doc_settings.py",
    "console": "tests/docs/test_doc_texts.py",
    "python": "tests/fleet/test_command.py",
    "msp": "tests/docs/test_msp_mission_page.py",
    "text": "nothing: a drawing",
}


def anchors(page: Path) -> set[str]:
    """The anchors of the headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S), re.MULTILINE)
    return {*map(_anchor, headings)}


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading).lower().replace(" ", "-")


@cache
def files() -> set[str]:
    """The names of the files in all folders, but those that another test may be building meanwhile."""
    folders = [folder for folder in REPOSITORY.glob("[!.]*") if folder.is_dir() and folder.name not in GENERATED]
    return {path.name for folder in folders for path in folder.rglob("*.*")} | {"CONTRIBUTING.md", "README.md"}


@cache
def names() -> set[str]:
    """All identifiers in the code."""
    return {
        word
        for package in CODE
        for file in (REPOSITORY / package).rglob("*.py")
        for word in re.findall(r"[A-Za-z_]\w+", file.read_text())
    }


def test_links_lead_to_pages_and_headings() -> None:
    broken = []
    for page, link in ((each, link) for each in PAGES for link in LINK.findall(prose_of(each))):
        path, _, anchor = link.partition("#")
        target = page if not path else page.parent / path
        if "://" not in link and (not target.exists() or (anchor and anchor not in anchors(target))):
            broken.append((place_of(page), link))
    assert broken == []


def test_every_page_is_linked_from_the_readme_or_from_a_page_that_is() -> None:
    reached, new = set[Path](), {REPOSITORY / "README.md"}
    while new:
        reached |= new
        links = {
            (page.parent / link.partition("#")[0]).resolve() for page in new for link in LINK.findall(prose_of(page))
        }
        new = {link for link in links if link.suffix == ".md" and link.exists()} - reached
    assert {*PAGES, REPOSITORY / "docs" / "cli.md"} - reached == set()


def test_files_in_the_text_exist() -> None:
    for page, span in ((each, span) for each in PAGES for span in spans(each)):
        folder = span.partition("/")[0]
        is_key = span.startswith("fleet/") and not span.endswith(("/", ".py"))  # of zenoh, under the default prefix
        is_source = folder not in ("", *GENERATED) and (REPOSITORY / folder).is_dir()
        if is_source and "/" in span and " " not in span and not is_key:
            assert (REPOSITORY / span).exists() or (page.parent / span).exists(), (place_of(page), span)
        elif re.fullmatch(r"[\w-]+\.(py|c|h|md)", span):
            assert span in files(), (place_of(page), span)


def test_pages_named_in_the_code_exist() -> None:
    """With their headings, as in: docs/zenoh.md, "Limits"."""
    wrong = []
    for folder in (*CODE, "tests", "firmware", "examples", "systemd", "deb", "generators", "benchmarks"):
        for file in (REPOSITORY / folder).rglob("*.*"):
            if file.suffix in {".py", ".c", ".h", ".toml", ".service", ".json5", ".yml"}:
                for page, heading in re.findall(r'(docs/[a-z/-]+\.md)(?:, "([^"]+)")?', file.read_text()):
                    named = REPOSITORY / page
                    if not named.exists() or (heading and _anchor(heading) not in anchors(named)):
                        wrong.append((str(file), page, heading))
    assert wrong == []


def test_names_in_the_tour_exist() -> None:
    page = REPOSITORY / "docs" / "design.md"
    for span in spans(page):
        if re.fullmatch(r"[A-Za-z_]\w+(\.[a-z_]\w+)*", span) and not span.endswith(".py"):
            assert {*span.split(".")} <= names(), span


def test_every_block_has_a_language_with_a_test() -> None:
    assert {block.place for block in blocks() if block.language not in LANGUAGES} == set()
    assert [block.place for block in blocks() if block.language == "text" and "──" not in block.text] == []
    assert {block.place.partition(":")[0] for block in blocks() if block.language == "msp"} == {"docs/msp-mission.md"}


def test_all_blocks_are_fenced() -> None:
    for page in PAGES:
        place = place_of(page)
        assert re.findall(r"\n\n(?! *[-*|]| *\d+\.) {4,}\S.*", prose_of(page)) == [], place
        count = len([block for block in blocks() if block.place.startswith(f"{place}:")])
        assert text_of(page).count("```") == 2 * count, place
