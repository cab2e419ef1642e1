// SPDX-License-Identifier: GPL-3.0-or-later
// Requests to the daemon. A missing reply is an error with one sentence, like every refusal.

const TIMEOUT_MS = 8000;

export const ask = async (path, token) => (await request(path, { headers: bearer(token) })).json();

export const post = async (path, token, body = null) =>
  (await request(path, { method: "POST", body, headers: { ...bearer(token), ...(body && { "Content-Type": "application/octet-stream" }) } })).json();

export const fetchBytes = async (path, token) => (await request(path, { headers: bearer(token) })).blob();

const bearer = (token) => (token ? { Authorization: `Bearer ${token}` } : {});

async function request(path, options) {
  let response;
  try {
    response = await fetch(path, { ...options, signal: AbortSignal.timeout(TIMEOUT_MS) });
  } catch {
    throw new Error("The Pi does not answer.");
  }
  if (!response.ok) throw new Error((await response.json()).error);
  return response;
}
