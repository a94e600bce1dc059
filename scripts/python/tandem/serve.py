"""A Python callable as a renderer of `tandem verify`: the lines of JSON of common/external/README.md, by a socket.

The program starts relay.py, which hands its standard input and output to the socket. The callable stays in the process
that called verify(), with all that it holds.
"""
import json
import pathlib
import socket
import sys

from tandem.images import save_image

RELAY = pathlib.Path(__file__).with_name("relay.py")
POLL_SECONDS = 0.05


def _quoted(word):
    """A word of an exec: command: nothing in it is a placeholder or the end of a quote."""
    return '"' + str(word).replace("\\", "\\\\").replace('"', '\\"').replace("{", "{{").replace("}", "}}") + '"'


class Served:
    def __init__(self, render, follows_model, folder):
        self.render, self.follows_model = render, follows_model
        path = str(pathlib.Path(folder, "socket"))
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(path)
        self.listener.listen()
        self.listener.settimeout(POLL_SECONDS)
        self.command = f"exec:{_quoted(sys.executable)} {_quoted(RELAY)} {_quoted(path)}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.close()

    def answer_while(self, process):
        """Until the program ends. What the callable raises is raised, and ends the verdict."""
        while process.poll() is None:
            try:
                connection, _ = self.listener.accept()
            except TimeoutError:
                continue
            with connection:
                try:
                    self._answer(connection)
                except (BrokenPipeError, ConnectionResetError):  # the program has ended the relay
                    pass

    def _answer(self, connection):
        def say(words):
            connection.sendall(json.dumps(words).encode() + b"\n")

        say({"tandem": 1, "name": getattr(self.render, "__name__", type(self.render).__name__), "ending": "npy",
             "follows_model": self.follows_model})
        with connection.makefile("rb") as lines:
            for line in lines:
                request = json.loads(line)
                asked = (request[key] for key in ("scene", "width", "height", "samples", "seed", "first_sample"))
                save_image(request["out"], self.render(*asked))
                say({"done": True})
