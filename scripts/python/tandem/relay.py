"""Started by `tandem verify` (serve.py): standard input to the socket that is named, and the socket to standard output."""
import socket
import sys
import threading


def main():
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(sys.argv[1])

        def ask():
            for line in sys.stdin.buffer:
                connection.sendall(line)
            connection.shutdown(socket.SHUT_WR)

        threading.Thread(target=ask, daemon=True).start()
        for line in connection.makefile("rb"):
            sys.stdout.buffer.write(line)
            sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
