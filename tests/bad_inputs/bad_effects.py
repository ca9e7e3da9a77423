"""Effect files that are wrong: the text of each, in the place of a hardening spring."""

from pathlib import Path

from myowave.physics.effects import catalogue

TEMPLATE = """import torch
from myowave.physics.effect import Effect, Parameter
{before}
def spring({arguments}):
    return {result}

EFFECT = Effect(
    name="{name}", acts_on="{stage}", equation="-k q^3", function=spring, source="test",
    parameters={{"k": Parameter(unit="N m", low={low}, high=5.0, typical=1.0, meaning="hardening spring")}},{more}
)
"""
GOOD = {"before": "", "arguments": "q, *, k", "result": "-k * q**3", "name": "hardening_spring", "stage": "joint"}
GOOD |= {"low": "0.0", "more": ""}


def of_file(folder: Path, content: str | dict[str, str]) -> str:
    """What loading an effect file is answered by."""
    path = folder / "faulty.py"
    text = content if isinstance(content, str) else TEMPLATE.format(**{**GOOD, **content})
    path.write_bytes(text.encode(errors="surrogateescape"))
    catalogue([path])
    return ""


def before(text: str, result: str = "wrong(q, k)", **changes: str) -> dict[str, str]:
    return {"before": text, "result": result, **changes}


COUNTER = "calls = []\ndef wrong(q, k):\n    calls.append(1)\n    return -k * q**3 * len(calls)\n"
MEMORY = "last = []\ndef wrong(q, k):\n    last.append(q.detach().mean())\n    return -k * last[-2:][0] * q\n"
RANDOM = "def wrong(q, k):\n    return -k * q**3 * torch.rand(())\n"
IN_PLACE = "def wrong(q, k):\n    with torch.no_grad():\n        q.mul_(1.01)\n    return -k * q**3\n"
DATA = "def wrong(q, k):\n    q.data.add_(0.01)\n    return -k * q**3\n"
ON_PARAMETER = "def wrong(q, k):\n    k.data.mul_(1.5)\n    return -k * q**3\n"
EXCITED = "def wrong(excitation, k):\n    excitation.data.clamp_(0.35)\n    return excitation + k\n"
ITEM = "def wrong(q, k):\n    return -float(k.flatten()[0]) * q**3\n"
BACKWARD = """class Wrong(torch.autograd.Function):
    @staticmethod
    def forward(ctx, q, k):
        ctx.save_for_backward(q, k)
        return -k * q**3
    @staticmethod
    def backward(ctx, slope):
        q, k = ctx.saved_tensors
        return -slope * k * q**2, -slope * q**3
"""
FILES = {
    "0 is an effect": ({"result": "-k * q**3 + 0.5"}, "0 must mean no effect"),
    "an infinite slope at 0": ({"result": "-torch.sqrt(k) * q"}, "derivative by hardening_spring.k at 0 is not finite"),
    "infinite within its bounds": ({"result": "k * torch.log(1.5 - k) * q"}, "not finite"),
    "one for each muscle": ({"arguments": "activation, *, k", "result": "k * activation"}, "shape|raised"),
    "an axis too many": ({"result": "(k * q).unsqueeze(-1)"}, "shape|raised"),
    "a mean over trials": ({"result": "(k * q).mean(-1)"}, "shape|raised"),
    "a quantity that is none": ({"arguments": "q, muscle, *, k"}, "asks for .'muscle'."),
    "a parameter that is not declared": ({"arguments": "q, *, k, c"}, "takes the parameters"),
    "a parameter that is not taken": ({"arguments": "q", "result": "-q"}, "takes the parameters"),
    "an unknown name": ({"result": "spring_constant * q"}, "NameError"),
    "bounds without 0": ({"low": "0.1"}, "must hold 0"),
    "a name that is taken": ({"name": "joint_damping"}, "taken"),
    "an unknown constant": (
        {"stage": "constants", "arguments": "mass, *, k", "result": "{'weight': mass + k}"}, "weight.*not constants"),
    "an end of the program": ({"result": "__import__('sys').exit(0)"}, "raised SystemExit: 0"),
    "nothing returned": ({"result": "None"}, "raised TypeError"),
    "text returned": ({"result": "'text'"}, "raised TypeError"),
    "a call without end": ({"result": "spring(q, k=k)"}, "raised RecursionError"),
    "an infinite bound": ({"low": "float('-inf')"}, "bounds .-inf, 5.0. must be finite"),
    "a bound that is no number": ({"low": "float('nan')"}, "bounds .nan, 5.0. must be finite"),
    "a bound of text": ({"low": "'0'"}, "line 9: .*TypeError"),
    "a name with an umlaut": ({"name": "kr\u00e4ftig"}, "identifier of ASCII letters"),
    "a name with a plus": ({"name": "two+effects"}, "identifier of ASCII letters"),
    "an unknown stage": ({"stage": "elbow"}, "acts_on is 'elbow'; expected one of"),
    "no derivative: detach": ({"result": "-k.detach() * q**3"}, "no derivative by .*without detach"),
    "no derivative: item": (before(ITEM), "no derivative by hardening_spring.k|raised"),
    "no derivative: numpy": ({"result": "-torch.as_tensor(k.detach().numpy()) * q**3"}, "no derivative by"),
    "no derivative: no_grad": (
        before("def wrong(q, k):\n    with torch.no_grad():\n        return -k * q**3\n"), "no derivative by"),
    "no derivative: a new tensor": ({"result": "torch.tensor(0.0, dtype=q.dtype) * q"}, "no derivative by"),
    "a derivative by the state that is lost": ({"result": "-k * q.detach()**3"}, "torch finds is .* small steps find"),
    "a derivative by the state that is lost in part": ({"result": "-k * q * q.detach()**2"}, "small steps find"),
    "a derivative of its own that is wrong": (before(BACKWARD, "Wrong.apply(q, k)"), "small steps find"),
    "an activation without derivative": (
        {"stage": "activation", "arguments": "activation, *, k", "result": "activation.detach() * (1 + k)"},
        "small steps find"),
    "a mean that is added": ({"result": "-(k * q**3).mean() + 0 * q"}, "without others beside it.*no mean, sum"),
    "trials in another order": ({"result": "-k * q.flip(-1)**3"}, "gave another angle .* without others"),
    "the sample before": ({"result": "-k * torch.roll(q, 1, -1)**3"}, "gave another angle .* without others"),
    "no number beyond the straight arm": ({"result": "-k * torch.sqrt(q)"}, "moves the angle by nan"),
    "a count of calls": (before(COUNTER), "gave another angle when it was called again.*Keep nothing between"),
    "a memory": (before(MEMORY), "gave another angle when it was called again"),
    "a random number": (before(RANDOM), "gave another angle when it was called again.*random number"),
    "an argument changed": (before(IN_PLACE), "changes q in place.*write x = x . y"),
    "an argument changed by data": (before(DATA), "changes q in place"),
    "a parameter changed": (before(ON_PARAMETER), "changes k in place"),
    "an excitation changed": (
        before(EXCITED, "wrong(excitation, k)", stage="excitation", arguments="excitation, *, k"),
        "changes excitation in place"),
    "a relaxation at the joint": ({"more": " relaxation=spring,"}, "may have a relaxation"),
    "an initial state without relaxation": ({"more": " initial=spring,"}, "no relaxation"),
    "single precision": ({"result": "(-k * q**3).float().half() * float('inf')"}, "0 must mean"),
    "no effect in it": ("EFFECT = 3\n", "holds no Effect"),
    "an error on reading": ("x = 1\nraise RuntimeError('boom')\n", "line 2: .*RuntimeError: boom"),
    "no Python": ("def f(:\n", "line 1: .*SyntaxError"),
    "an end on reading": ("import sys\nsys.exit(0)\n", "line 2: .*raised SystemExit: 0. Correct the file there"),
    "exit()": ("exit()\n", "line 1: .*raised SystemExit"),
    "a package that is not there": ("import no_such_package\n", "line 1: .*No module named 'no_such_package'"),
    "empty": ("", "holds no Effect"),
    "a zero byte": ("x = 1\0\n", "raised (ValueError|SyntaxError): source code string cannot contain null bytes"),
    "another encoding": ("x = '\udcff'\n", "SyntaxError.*utf-8"),
}  # fmt: skip
