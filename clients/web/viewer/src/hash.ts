// SPDX-License-Identifier: Apache-2.0
// What the address says after its `#`, which no server and no log ever sees: the token, the model, the session.

const TOKEN_KEY = "ecorche.token";

/** All of it but the token. */
export function hashParameters(): URLSearchParams {
  return new URLSearchParams(location.hash.slice(1));
}

/** The token, which from now on is kept by this tab and no longer stands in the address. */
export function takeToken(): string | undefined {
  const parameters = hashParameters();
  const token = parameters.get("token");
  if (token === null) return sessionStorage.getItem(TOKEN_KEY) ?? undefined;
  sessionStorage.setItem(TOKEN_KEY, token);
  parameters.delete("token");
  const rest = parameters.toString();
  history.replaceState(history.state, "", location.pathname + location.search + (rest ? `#${rest}` : ""));
  return token;
}
