"""`spin-usd serve`: pictures of a stage for other programs, as they ask for them."""

from spin_usd.commands.serve.options import ServeOptions
from spin_usd.errors import UnsupportedError
from spin_usd.terminal.lines import print_out


def serve(options: ServeOptions) -> None:
    """Make pictures of a stage as other programs on this machine ask for them: poses, light and times in; images,
    labels and truth out.

    They speak ZeroMQ and msgpack; docs/loop_client.py is a client. With --log all that they ask for
    becomes a stage, which render makes again to the same images. Ctrl-C ends.
    """
    try:
        from spin_usd.commands.serve.run import serve as follow
    except ModuleNotFoundError as error:
        if error.name != "zmq":
            raise
        raise UnsupportedError("serve needs pyzmq", do="install spin_usd[serve]") from None

    follow(options, tell=print_out)
