"""Commands that refuse an option given twice where it takes one value; click would drop all values but the last."""

from __future__ import annotations

import click


class GivenOnce(click.Command):
    """A command each of whose options is given once, unless the option says that it may be repeated."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse repeated options, then parse as click does."""
        _refuse_repeated(self, ctx, args)
        return super().parse_args(ctx, args)


class GivenOnceGroup(click.Group):
    """A group of such commands, whose own options are given once too."""

    command_class = GivenOnce

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Refuse repeated options, then parse as click does."""
        _refuse_repeated(self, ctx, args)
        return super().parse_args(ctx, args)


def _refuse_repeated(command: click.Command, ctx: click.Context, args: list[str]) -> None:
    _, _, given = command.make_parser(ctx).parse_args(list(args))
    single = {o for o in given if isinstance(o, click.Option) and not o.multiple and not o.is_flag}
    for option in single:
        if (times := given.count(option)) > 1:
            raise click.UsageError(f"{option.opts[0]} is given {times} times; this command takes one.", ctx)
