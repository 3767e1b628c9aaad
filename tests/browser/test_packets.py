"""The packet inspector in a real browser: frames of this tab, taken apart as the command does."""

import subprocess
import sys
from urllib.request import urlopen

import pytest

from browser.page_rig import Page, PageRig

OPTIONS = ("--format", "tree", "--dialect", "pendant", "--color", "never")
SHOWN = "[...document.querySelectorAll('button.packet')].filter(each => !each.hidden)"


@pytest.fixture
def packets(page_rig: PageRig) -> Page:
    """A page in control whose inspector leaves states out."""
    page = page_rig.page()
    page.ready()
    page.run("document.querySelector('[data-task=packets]').click()")
    page.wait("document.querySelector('[data-kind=\"no state\"]')")
    page.run("document.querySelector('[data-kind=\"no state\"]').click()")
    return page


def _filter(page: Page, text: str) -> None:
    page.run(
        "const box = document.querySelector('.packets input');"
        f"box.value = '{text}'; box.dispatchEvent(new Event('input'))"
    )


def _choose(page: Page, text: str) -> None:
    _filter(page, text)
    fits = f"each => each.innerText.toLowerCase().includes('{text}')"
    page.wait(f"{SHOWN}.length > 0 && {SHOWN}.every({fits})")
    page.run(f"{SHOWN}.find(each => each.children[2].innerText === '{text}').click()")
    page.wait("document.querySelector('.packet-detail').offsetParent !== null")


def _hexadecimal(page: Page) -> str:
    digits = "[...document.querySelectorAll('.hex .byte')].map(each => each.innerText).join('')"
    return str(page.run(f"return {digits}"))


def test_a_frame_of_the_tab_is_told_as_the_command_prints_it(packets: Page) -> None:
    _choose(packets, "declare")
    printed = subprocess.run(
        [sys.executable, "-m", "openpendant.tools", "packets", "decode", *OPTIONS],
        input=_hexadecimal(packets),
        capture_output=True,
        text=True,
        check=True,
    )
    values = [line.split()[2] for line in printed.stdout.splitlines()[1:]]
    told = packets.run(
        "return [...document.querySelectorAll('.field .value')].map(each => each.innerText)"
    )
    assert told == values


def test_the_reference_of_a_frame_is_a_section_of_the_page_beside(packets: Page) -> None:
    _choose(packets, "declare")
    link = str(packets.run("return document.querySelector('.packet-detail footer a').href"))
    assert link == f"{packets.address}reference.html#declare"
    with urlopen(link.partition("#")[0]) as answer:
        section = answer.read().decode().partition('<section id="declare">')[2]
    assert "enabling is let go so long after its last sign" in section.partition("</section>")[0]


def test_pressing_a_byte_marks_its_field(packets: Page) -> None:
    _choose(packets, "declare")
    packets.run("document.querySelectorAll('.hex .byte')[22].click()")
    marked = "document.querySelector('.field.marked .path')?.innerText"
    assert packets.run(f"return {marked}") == "enabling_deadline"
    packets.run("document.querySelectorAll('.field')[4].click()")
    bytes_marked = "document.querySelectorAll('.byte.marked').length"
    assert packets.run(f"return [{marked}, {bytes_marked}]") == ["request_id", 4]


def test_a_paused_list_stands_still_while_frames_come(packets: Page) -> None:
    packets.run("document.querySelector('[data-kind=all]').click()")
    packets.wait(f"{SHOWN}.length > 5 && document.querySelector('.packets footer').innerText")
    packets.wait("document.querySelector('button.packet.state:not([hidden])') !== null")
    packets.run("document.querySelector('.pause').click()")
    last = f"{SHOWN}.at(-1).dataset.number"
    # What was scrolled last is drawn once more.
    packets.run("return new Promise(done => requestAnimationFrame(() => setTimeout(done, 50)))")
    before = packets.run(f"return {last}")
    packets.wait("Number(document.querySelector('.packets footer').innerText.split(' ')[0]) > 10")
    assert packets.run(f"return {last}") == before
    packets.run("document.querySelector('.pause').click()")
    packets.wait(f"{last} > {before} + 10")


def test_the_newest_frame_is_in_sight_and_a_chosen_one_stays_there_among_all(packets: Page) -> None:
    in_sight = (
        "(each => { const list = document.querySelector('.packets .list').getBoundingClientRect();"
        "const row = each.getBoundingClientRect();"
        "return row.top >= list.top && row.bottom <= list.bottom + 1; })"
    )
    packets.run("document.querySelector('[data-kind=all]').click()")
    # More than the list has room for.
    packets.wait("document.querySelector('.packets .sheet').clientHeight > 2400")
    newest = f"{SHOWN}.reduce((a, b) => +a.dataset.number > +b.dataset.number ? a : b)"
    packets.wait(f"{in_sight}({newest}) && +{newest}.dataset.number > 60")
    packets.run("document.querySelector('[data-kind=\"no state\"]').click()")
    no_state = "each => !each.classList.contains('state')"
    packets.wait(f"{SHOWN}.length > 0 && {SHOWN}.every({no_state})")
    packets.run(f"{newest}.click()")
    packets.run("document.querySelector('[data-kind=all]').click()")
    packets.wait(f"{SHOWN}.some(each => each.classList.contains('selected') && {in_sight}(each))")
    packets.wait(f"{SHOWN}.some(each => each.classList.contains('state'))")
    assert packets.run(f"return {SHOWN}.some(each => each.classList.contains('selected'))")


def test_a_refusal_is_found_among_all_frames(packets: Page) -> None:
    packets.run("document.querySelector('[data-task=plan]').click()")
    packets.wait("document.querySelector('.plan select')?.options.length > 1")
    packets.run(
        "const goal = document.querySelector('.plan select'); goal.value = '';"
        "goal.dispatchEvent(new Event('change'));"
        "const box = document.querySelector('.reach input'); box.value = '5000';"
        "box.dispatchEvent(new Event('change'))"
    )
    packets.wait("document.querySelector('.reach .told.bad') !== null")
    packets.run("document.querySelector('[data-task=packets]').click()")
    packets.wait("document.querySelector('[data-kind=refused]') !== null")
    packets.run("document.querySelector('[data-kind=refused]').click()")
    packets.wait(f"{SHOWN}.every(each => each.classList.contains('refused'))")
    packets.wait(f"{SHOWN}.some(each => each.innerText.includes('UNREACHABLE'))")


def test_a_secret_is_in_no_frame_that_is_kept(packets: Page) -> None:
    packets.run("document.querySelector('.chip').click()")
    packets.wait("document.querySelector('.veil input[type=password]')?.offsetParent")
    packets.run(
        "const secret = document.querySelector('.veil input[type=password]');"
        "secret.form.querySelector('input:not([type=password])').value = 'anna';"
        "secret.value = 'swordfish-of-the-class'; secret.form.requestSubmit()"
    )
    _choose(packets, "login")
    assert b"swordfish".hex() not in _hexadecimal(packets)
    assert '"********"' in packets.text(".packet-detail .fields")
