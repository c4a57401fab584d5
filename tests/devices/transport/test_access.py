"""The router's configuration, and that the documentation shows the one that is made."""

import json

from devices.transport.access import COMMENT, EXAMPLE, FOLDER, access_rules, router_fields, to_json5
from tests.devices.transport.networks import ROUTER_FILE, without_comments


def test_the_documentation_s_file_is_what_is_made():
    fields = router_fields(FOLDER, listen="0.0.0.0:7447", members=EXAMPLE)
    assert ROUTER_FILE.read_text(encoding="utf-8") == to_json5(fields, comment=COMMENT)


def test_a_file_is_json_but_for_its_comment():
    text = to_json5({"mode": "router"}, comment="one\ntwo")
    assert text.startswith("// one\n// two\n")
    assert json.loads(without_comments(text)) == {"mode": "router"}


def test_what_no_rule_allows_is_denied():
    rules = access_rules(EXAMPLE)
    assert (rules["enabled"], rules["default_permission"]) == (True, "deny")
    assert all(rule["permission"] == "allow" for rule in rules["rules"])
    keys = [key for rule in rules["rules"] for key in rule["key_exprs"]]
    assert all(key.startswith("gn/") and key != "gn/**" for key in keys)
    assert {"delete", "liveliness_token"}.isdisjoint(
        message for rule in rules["rules"] for message in rule["messages"]
    )


def test_each_name_has_rules_of_its_own():
    rules = access_rules(EXAMPLE)
    named = {subject["id"]: subject["cert_common_names"] for subject in rules["subjects"]}
    assert named["site:north"] == ["site:north"]
    by_subject = {policy["subjects"][0]: policy["rules"] for policy in rules["policies"]}
    assert len(by_subject["room:hall-3"]) == 4
    assert len(by_subject["watcher:lobby"]) == 2, "it speaks nowhere"


def test_without_members_there_is_no_tls():
    fields = router_fields("", listen="127.0.0.1:7447", members=None)
    assert fields["listen"]["endpoints"] == ["tcp/127.0.0.1:7447"]
    assert "access_control" not in fields
    assert "tls" not in fields["transport"]["link"]
