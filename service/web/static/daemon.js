// SPDX-License-Identifier: GPL-3.0-or-later
// Asking the daemon. An answer that does not come in time is an error with a sentence.

const PATIENCE_MS = 8000;

export const ask = (path) => request(path, {});

export const tell = (path, token) => request(path, { method: "POST", headers: { Authorization: `Bearer ${token}` } });

async function request(path, options) {
  let response;
  try {
    response = await fetch(path, { ...options, signal: AbortSignal.timeout(PATIENCE_MS) });
  } catch {
    throw new Error("The Pi does not answer.");
  }
  const answer = await response.json();
  if (!response.ok) throw new Error(answer.error);
  return answer;
}
