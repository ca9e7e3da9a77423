# What a study starts from: the settings of config.yaml with its own laid over, and its code where its scripts find it.
# Its Snakefile names it, STUDY, before this is included.
import os
import sys
from pathlib import Path

ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True)).parent
sys.path.insert(0, str(ROOT))
# Scripts are processes of their own.
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))


configfile: ROOT / "config.yaml"
configfile: ROOT / "studies" / STUDY / "settings.yaml"


OWN = config.pop(STUDY, {})


include: "../workflow/rules/common.smk"
include: "../workflow/rules/data.smk"


from myowave.workflow.digest import PACKAGE
from studies.shared import read_section


def own_section(kind):
    """The study's section of the settings."""
    try:
        return read_section(kind, STUDY, OWN, SETTINGS)
    except ValueError as error:
        sys.exit(f"The configuration has problems; nothing was run.\n{error}")


def study_digest(script):
    """Digest of a script of the study and of all the code that it uses, here and in myowave."""
    return digest_script(ROOT / "studies" / STUDY / "scripts" / f"{script}.py", roots=(PACKAGE.parent, ROOT))
