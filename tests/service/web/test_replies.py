# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers in paths, and the store's errors."""

import asyncio

import pytest
from starlette.exceptions import HTTPException

from payloads.mission_data import Json
from service.daemon.client import ControlError
from service.web.replies import answered, begun, whole
from storage.store_error import StoreError


@pytest.mark.parametrize("text", ["", "-1", "1.5", "x", "9" * 30, "2147483648", "²"])
def test_what_is_no_number_is_not_found(text: str) -> None:
    with pytest.raises(HTTPException) as caught:
        whole(text)
    assert caught.value.status_code == 404


def test_a_number_is_read() -> None:
    assert whole("2147483647") == 2147483647


@pytest.mark.parametrize(("error", "status"), [(ControlError("none"), 404), (StoreError("full"), 503)])
def test_the_stores_errors_become_refusals(error: Exception, status: int) -> None:
    async def fails() -> Json:
        raise error

    with pytest.raises(HTTPException) as caught:
        asyncio.run(answered(fails()))
    assert (caught.value.status_code, caught.value.detail) == (status, str(error))


def test_a_write_that_was_begun_has_an_id() -> None:
    reply = begun("abc")
    assert (reply.status_code, reply.body) == (202, b'{"id": "abc"}')
