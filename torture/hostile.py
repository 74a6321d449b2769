"""Robot files that are built to hurt a reader, by name: the suffix, and what makes the content."""

from __future__ import annotations

from collections.abc import Callable

MANY = 1_000_000
MEGABYTE = 2**20
LINK = '<link name="{0}"/>'
JOINT = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><limit lower="-1" upper="1"/></joint>'
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">{}]><robot name="&z;"/>'.format(
    ''.join(f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip('abcdefghi', 'bcdefghiz'))
)
HEAD = 'name: x\nsource: x\nconvention: standard\nangles: radians\nbase_frame: base\ntip_frame: tip\njoints:\n'
ROW = '  - {{name: {}, type: revolute, a: 0, alpha: 0, d: 0, theta: 0, lower: -1, upper: 1}}\n'


def robot(*parts: str) -> str:
    """Return a URDF document."""
    return f'<robot name="x">{"".join(parts)}</robot>'


def links(count: int) -> str:
    return ''.join(LINK.format(f'l{k}') for k in range(count))


def cycle() -> str:
    """Return three links of which each is the child of the one before."""
    return robot(links(3), *(JOINT.format(f'j{k}', f'l{k}', f'l{(k + 1) % 3}') for k in range(3)))


def alias_bomb() -> str:
    """Return YAML whose aliases expand to 1e9 nodes."""
    rows = ['a: &a [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]']
    rows += [f'{new}: &{new} [{", ".join([f"*{old}"] * 10)}]' for old, new in zip('abcdefgh', 'bcdefghi')]
    return '\n'.join(rows)


HOSTILE: dict[str, tuple[str, Callable[[], str | bytes]]] = {
    'an empty URDF': ('.urdf', lambda: ''),
    'a URDF cut in the middle': ('.urdf', lambda: cycle()[:200]),
    'a cycle of links': ('.urdf', cycle),
    'a link that is its own parent': ('.urdf', lambda: robot(links(1), JOINT.format('j', 'l0', 'l0'))),
    'a million links': ('.urdf', lambda: robot(links(MANY // 2))),
    '33 MB of nothing': ('.urdf', lambda: robot(' ' * 33 * MEGABYTE)),
    '31 MB of one attribute': ('.urdf', lambda: robot(LINK.format('x' * 31 * MEGABYTE))),
    'elements nested a million deep': ('.urdf', lambda: '<robot>' + '<a>' * MANY + '</a>' * MANY + '</robot>'),
    'an entity bomb': ('.urdf', lambda: BOMB),
    'an external entity': ('.urdf', lambda: '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]><robot>&a;</robot>'),
    'a binary file': ('.urdf', lambda: bytes(range(256)) * 1000),
    'UTF-16 without a mark': ('.urdf', lambda: cycle().encode('utf-16-le')),
    'a joint with a list of types': ('.urdf', lambda: cycle().replace('revolute', 'revolute prismatic')),
    'an empty table': ('.yaml', lambda: ''),
    'aliases of aliases': ('.yaml', alias_bomb),
    'a YAML list nested 200000 deep': ('.yaml', lambda: '[' * 200_000),
    'a YAML tag that makes objects': ('.yaml', lambda: 'name: !!python/object/apply:os.getcwd []'),
    'a table whose joints are a number': ('.yaml', lambda: HEAD.replace('joints:', 'joints: 7')),
    'a table of 100000 joints': ('.yaml', lambda: HEAD + ''.join(ROW.format(f'j{k}') for k in range(MANY // 10))),
    'a table with two joints of one name': ('.yaml', lambda: HEAD + ROW.format('j') * 2),
    'a binary table': ('.yaml', lambda: bytes(range(256)) * 1000),
}
