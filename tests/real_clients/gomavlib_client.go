// SPDX-License-Identifier: GPL-3.0-or-later

// Writes a mission of COUNT waypoints to the vehicle at ADDRESS, reads it back with all parameters, and prints what it
// got in one line: the MAV_MISSION_RESULT, the items read, the parameters announced and read.
package main

import (
	"fmt"
	"os"
	"strconv"
	"time"

	"github.com/bluenviron/gomavlib/v3"
	"github.com/bluenviron/gomavlib/v3/pkg/dialects/common"
	"github.com/bluenviron/gomavlib/v3/pkg/message"
)

var node *gomavlib.Node

func send(msg message.Message) {
	if err := node.WriteMessageAll(msg); err != nil {
		panic(err)
	}
}

func item(seq uint16) *common.MessageMissionItemInt {
	frame := common.MAV_FRAME_GLOBAL_RELATIVE_ALT
	if seq == 0 {
		frame = common.MAV_FRAME_GLOBAL
	}
	return &common.MessageMissionItemInt{
		TargetSystem: 1, TargetComponent: 1, Seq: seq, Frame: frame, Command: common.MAV_CMD_NAV_WAYPOINT,
		Autocontinue: 1, X: 453838000 + 900*int32(seq), Y: 84733000, Z: 20,
	}
}

func main() {
	count, _ := strconv.Atoi(os.Args[2])
	made, err := gomavlib.NewNode(gomavlib.NodeConf{
		Endpoints:   []gomavlib.EndpointConf{gomavlib.EndpointUDPClient{Address: os.Args[1]}},
		Dialect:     common.Dialect,
		OutVersion:  gomavlib.V2,
		OutSystemID: 255,
	})
	if err != nil {
		panic(err)
	}
	node = made
	defer node.Close()

	result, items, params, isFound := -1, 0, map[uint16]bool{}, false
	send(&common.MessageHeartbeat{Type: common.MAV_TYPE_GCS, Autopilot: common.MAV_AUTOPILOT_INVALID, MavlinkVersion: 3})
	deadline := time.After(60 * time.Second)
	for {
		select {
		case <-deadline:
			fmt.Println("timeout", result, items, len(params))
			return
		case event := <-node.Events():
			frame, ok := event.(*gomavlib.EventFrame)
			if !ok || frame.SystemID() != 1 {
				continue
			}
			switch msg := frame.Message().(type) {
			case *common.MessageHeartbeat:
				if !isFound {
					isFound = true
					send(&common.MessageMissionCount{TargetSystem: 1, TargetComponent: 1, Count: uint16(count)})
				}
			case *common.MessageMissionRequest:
				send(item(msg.Seq))
			case *common.MessageMissionAck:
				result = int(msg.Type)
				send(&common.MessageMissionRequestList{TargetSystem: 1, TargetComponent: 1})
			case *common.MessageMissionCount:
				send(&common.MessageMissionRequestInt{TargetSystem: 1, TargetComponent: 1, Seq: 0})
			case *common.MessageMissionItemInt:
				items++
				if items < count {
					send(&common.MessageMissionRequestInt{TargetSystem: 1, TargetComponent: 1, Seq: uint16(items)})
				} else {
					send(&common.MessageMissionAck{TargetSystem: 1, TargetComponent: 1})
					send(&common.MessageParamRequestList{TargetSystem: 1, TargetComponent: 1})
				}
			case *common.MessageParamValue:
				params[msg.ParamIndex] = true
				if len(params) == int(msg.ParamCount) {
					fmt.Println(result, items, msg.ParamCount, len(params))
					return
				}
			}
		}
	}
}
