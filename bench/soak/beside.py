# SPDX-License-Identifier: Apache-2.0
import threading


class Beside:
    """Does one thing after the other, again and again, on a thread of its own where the server is, until the `with` ends."""

    def __init__(self, place, pause, things):
        self.place, self._pause, self._things = place, pause, things
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._work)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._done.set()
        self._thread.join()

    def _work(self):
        with self.place.where():
            while not self._done.is_set():
                for one in self._things:
                    if self._done.wait(self._pause):
                        return
                    self.do(one)

    def do(self, one):
        raise NotImplementedError
