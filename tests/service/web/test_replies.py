# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers in paths."""

import pytest
from starlette.exceptions import HTTPException

from service.web.replies import begun, whole


@pytest.mark.parametrize("text", ["", "-1", "1.5", "x", "9" * 30, "2147483648", "²"])
def test_what_is_no_number_is_not_found(text: str) -> None:
    with pytest.raises(HTTPException) as caught:
        whole(text)
    assert caught.value.status_code == 404


def test_a_number_is_read() -> None:
    assert whole("2147483647") == 2147483647


def test_a_write_that_was_begun_has_an_id() -> None:
    reply = begun("abc")
    assert (reply.status_code, reply.body) == (202, b'{"id": "abc"}')
