"""`spin-usd serve`: pictures of a stage for other programs, on request."""

from spin_usd.basics.extras import EXTRAS
from spin_usd.commands.serve.options import ServeOptions
from spin_usd.terminal.lines import print_out


def serve(options: ServeOptions) -> None:
    """Make pictures for other programs on request: poses, light and times in; images, labels and truth out.

    The protocol is ZeroMQ and msgpack; docs/loop_client.py is an example of a client. With --log all requests become a
    stage, which render turns into the same images. Ctrl-C stops the server.
    """
    EXTRAS["serve"].require()
    from spin_usd.commands.serve.run import serve as follow

    follow(options, tell=print_out)
