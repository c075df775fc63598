"""Commands with one mistake each."""

from __future__ import annotations

import click
from catching import caught_command

from lsds.testing import commands


@caught_command(commands.check_is_a_click_command, "is function, not a click command")
def bare_function(options, context):
    """Greet."""


class OwnUsage(click.Command):
    def format_usage(self, ctx, formatter):
        formatter.write_usage("greet.py", "[OPTIONS]")


@caught_command(commands.check_help_names_it, "let click write the usage")
@click.command(cls=OwnUsage)
def names_another_program():
    """Greet."""


@caught_command(commands.check_help_names_it, "--help ends with exit code 2")
@click.command(add_help_option=False)
def has_no_help():
    """Greet."""


def help_with_3(ctx, option, value):
    if value:
        click.echo(ctx.get_help())
        ctx.exit(3)


@caught_command(commands.check_help_names_it, "--help ends with exit code 3")
@click.command(add_help_option=False)
@click.option("--help", is_flag=True, is_eager=True, expose_value=False, callback=help_with_3)
def help_that_fails():
    """Greet."""


@caught_command(commands.check_has_a_summary, "has no help")
@click.command()
def has_no_docstring():
    pass


@caught_command(commands.check_has_a_summary, "has several lines")
@click.command()
def summary_of_two_lines():
    """Greet the person who is named,
    or everybody.
    """


@click.group()
def with_a_silent_command():
    """Greet."""


@with_a_silent_command.command()
def loudly():
    pass


caught_command(commands.check_has_a_summary, "lsds with-a-silent-command loudly has no help")(with_a_silent_command)


@caught_command(commands.check_refuses_an_unknown_option, "--no-such-option is accepted")
@click.command(context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
def takes_anything():
    """Greet."""
    raise AssertionError("a check has invoked the command")


class Fails(click.Command):
    def parse_args(self, ctx, args):
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            raise self.instead(error) from error


class FailsWith1(Fails):
    def instead(self, error):
        return click.ClickException(error.message)


class FailsWithoutUsage(Fails):
    def instead(self, error):
        return click.UsageError(error.message)


class FailsWithATraceback(Fails):
    def instead(self, error):
        return KeyError(error.option_name)


@caught_command(commands.check_refuses_an_unknown_option, "ends with exit code 1")
@click.command(cls=FailsWith1)
def another_exit_code():
    """Greet."""


@caught_command(commands.check_refuses_an_unknown_option, "without a line of usage")
@click.command(cls=FailsWithoutUsage)
def no_usage():
    """Greet."""


@caught_command(commands.check_refuses_an_unknown_option, "raised KeyError")
@click.command(cls=FailsWithATraceback)
def a_traceback():
    """Greet."""


class ImportsForItsHelp(click.Command):
    def get_help(self, ctx):
        import scipy  # noqa: F401

        return super().get_help(ctx)


@caught_command(commands.check_help_is_cheap, "showing its help imports .*scipy")
@click.command(cls=ImportsForItsHelp)
def heavy_help():
    """Greet."""
